#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"
#include "bake_exact_arithmetic.glsl"

// The mean of two maps' ratios, rounded down: bake_hybrid.

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer First { float first[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) readonly buffer Second { float second[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) writeonly buffer Means { float means[]; };

void main() {
  ivec2 texel = own_texel();
  if (is_outside(texel)) return;
  int i = index_of(texel);
  precise double mean = 0.5lf * (double(first[i]) + double(second[i]));
  bool is_cut_short = first[i] == CUT_SHORT || second[i] == CUT_SHORT;
  means[i] = is_cut_short ? CUT_SHORT : rounded_down(mean);
}
