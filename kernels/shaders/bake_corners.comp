#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"

// The heights at the corners of every cell between texels: (0, 0), (1, 0), (0, 1), (1, 1) from a texel on. So the
// surface anywhere takes one load.

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Heights { float heights[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) writeonly buffer Corners { vec4 corners[]; };

float height_at(ivec2 texel) { return heights[index_of(wrapped(texel))]; }

void main() {
  ivec2 texel = own_texel();
  if (is_outside(texel)) return;
  corners[index_of(texel)] =
      vec4(height_at(texel), height_at(texel + ivec2(1, 0)), height_at(texel + ivec2(0, 1)), height_at(texel + 1));
}
