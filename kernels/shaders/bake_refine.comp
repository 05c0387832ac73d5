#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_finer.glsl"
#include "bake_exact_arithmetic.glsl"

// The surface at the points of a finer grid: refine (kernels/maps/fine_grid.h).

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Heights { float heights[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) writeonly buffer Points { float points[]; };

double height_at(ivec2 texel) { return double(heights[map_index(texel)]); }

double share(int part, int by) { return part == 0 ? 0.0lf : divide(double(part), double(by)); }

void main() {
  ivec2 point = own_texel();
  if (is_outside(point)) return;
  ivec2 low = point / by;
  ivec2 part = point - low * by;
  double fx = share(part.x, by.x);
  double fy = share(part.y, by.y);
  precise double bottom = height_at(low) * (1.0lf - fx) + height_at(low + ivec2(1, 0)) * fx;
  precise double top = height_at(low + ivec2(0, 1)) * (1.0lf - fx) + height_at(low + 1) * fx;
  precise double height = bottom * (1.0lf - fy) + top * fy;
  points[index_of(point)] = rounded_down(height);
}
