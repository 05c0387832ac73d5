#version 450
#extension GL_GOOGLE_include_directive : require
#include "platform.glsl"

// What the sampler's linear filter makes of two texels, 0 and 1, side by side: the weight of the second, which a pixel
// asks for in 1/(width height) of the way from the first one's centre.
layout(BINDING(1)) uniform sampler2D two_texels;

layout(location = 0) out float out_weight;

const int SIDE = 128;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float wanted = float(pixel.y * SIDE + pixel.x) / float(SIDE * SIDE);
  out_weight = textureLod(two_texels, vec2((0.5 + wanted) / 2.0, 0.5), 0.0).x;
}
