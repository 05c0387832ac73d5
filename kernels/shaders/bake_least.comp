#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"

// The lesser of two maps' ratios, in every layer; CUT_SHORT is the least.

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer First { float first[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) readonly buffer Second { float second[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) writeonly buffer Least { float least[]; };

void main() {
  ivec2 texel = own_texel();
  if (is_outside(texel)) return;
  int i = layered(texel);
  least[i] = min(first[i], second[i]);
}
