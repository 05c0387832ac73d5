#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_finer.glsl"
#ifdef HAS_DOUBLES
#include "bake_exact_arithmetic.glsl"
#endif

// What is proved of the cones over each cell of a finer grid, by its own corners or by those of the map's cell that it
// is part of; guarded over the rounding of what is made of it.

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer OfPoints { float of_points[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) readonly buffer OfTexels { float of_texels[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) writeonly buffer Bounds { float bounds[]; };

float guard = bake.guard;
float max_ratio = bake.max_ratio;

// CUT_SHORT stays what it is. What is returned grows with the ratio.
float guarded(float ratio) {
  if (ratio <= 0.0) return ratio;
#ifdef HAS_DOUBLES
  precise double divisor = 1.0lf + double(guard) * double(ratio);
  return rounded_down(divide(double(ratio), divisor));
#else
  const float ROUNDING = 1.0 - 1e-6;
  return ratio / (1.0 + guard * ratio) * ROUNDING;
#endif
}

float bound_of_cell(ivec2 cell) {
  ivec2 cell_of_map = cell / by;
  float by_points = WIDE;
  float by_texels = max_ratio;
  for (int i = 0; i < 4; ++i) {
    ivec2 corner = ivec2(i & 1, i >> 1);
    by_points = min(by_points, of_points[layered(wrapped(cell + corner))]);
    by_texels = min(by_texels, of_texels[map_layered(cell_of_map + corner)]);
  }
  bool is_cut_short = by_points < 0.0 || by_texels < 0.0;
  return is_cut_short ? CUT_SHORT : max(min(guarded(by_points), max_ratio), by_texels);
}

void main() {
  ivec2 cell = own_texel();
  if (!is_outside(cell)) bounds[layered(cell)] = bound_of_cell(cell);
}
