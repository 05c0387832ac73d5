#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"

// The mean of two maps' ratios, rounded down: bake_hybrid.

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer First { float first[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) readonly buffer Second { float second[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) writeonly buffer Means { float means[]; };

// The greatest float that is not above a + b, for a, b >= 0: the sum as the device rounds it, less an ulp where that is
// above. source: Knuth, The Art of Computer Programming 2, 4.2.2, theorem B: what is left is exact
float sum_rounded_down(float a, float b) {
  precise float sum = a + b;
  precise float own_b = sum - a;
  precise float own_a = sum - own_b;
  precise float left = (a - own_a) + (b - own_b);
  return left < 0.0 ? uintBitsToFloat(floatBitsToUint(sum) - 1u) : sum;
}

void main() {
  ivec2 texel = own_texel();
  if (is_outside(texel)) return;
  int i = index_of(texel);
  bool is_cut_short = first[i] == CUT_SHORT || second[i] == CUT_SHORT;
  means[i] = is_cut_short ? CUT_SHORT : sum_rounded_down(0.5 * first[i], 0.5 * second[i]);
}
