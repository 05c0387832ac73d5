#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"
#include "bake_exact_arithmetic.glsl"

// A solid's cones, up and down, side by side: bake_double_cone (kernels/maps/bake_double.cpp). Those down are narrower
// by what mirroring floors rounds.

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Up { float up[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) readonly buffer Down { float down[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) writeonly buffer Both { vec2 both[]; };

float narrowed(float ratio) {
  if (ratio <= 0.0) return ratio;  // or CUT_SHORT
  double nearest = divide(square_root(min(bake.weight_x, bake.weight_y) - bake.slack), bake.side);
  precise double error = MIRROR_ERROR * double(ratio);
  precise double longer = 1.0lf + divide(error, nearest);
  return rounded_down(divide(double(ratio), longer));
}

void main() {
  ivec2 texel = own_texel();
  if (is_outside(texel)) return;
  int i = index_of(texel);
  both[i] = vec2(up[i], narrowed(down[i]));
}
