#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

// What a sampler's linear filter makes of the texels of relief_map, 4 x 2, read as a trace reads its map. The left two
// are 0 and 1: shown is the weight of the second, which a pixel asks for in 1/SIDE^2 of the way from the first one's
// centre. The right ones are nearly alike: shown is what a pixel reads in a cell of SIDE x SIDE places.
layout(location = 0) out vec2 out_shown;

const int SIDE = 128;

ivec2 map_size() { return textureSize(relief_map, 0); }

float shown(vec2 texel) {
  int taps = 0;
  return sample_map(relief_map, (0.5 + texel) / vec2(map_size()), 0, taps).x;
}

void main() {
  vec2 pixel = floor(gl_FragCoord.xy);
  float weight = (pixel.y * float(SIDE) + pixel.x) / float(SIDE * SIDE);
  out_shown = vec2(shown(vec2(weight, 0.0)), shown(vec2(2.0, 0.0) + pixel / float(SIDE)));
}
