#include "bake_common.glsl"
#include "bake_exact_arithmetic.glsl"

// What a safety shape's radius asks of the surface between texels: kernels/maps/bake_safety_shape.cpp, whose arithmetic
// it is, rounding by rounding.

// A node of level 0 is LEAST_NODE x LEAST_NODE cells.

// The cells between texels; under clamp also those of the flat border, which cell -1 and the last one stand for.
int first_cell() { return repeats ? 0 : -1; }
ivec2 cells() { return sides - first_cell(); }

// Nodes along the axes at a level.
ivec2 nodes_at(int level) {
  int side = LEAST_NODE << level;
  return (cells() + side - 1) / side;
}
int shape_index(int level, ivec2 node) {
  ivec4 place = bake.levels[level];
  return place.x + node.y * place.y + node.x;
}

// A corner of a cell, and the surface's gradient there.
struct Corner {
  double height;
  double slope_x;
  double slope_y;
};

// Heights and gradient of a part of the surface.
struct Shape {
  double low;
  double high;
  double low_x;
  double high_x;
  double low_y;
  double high_y;
};
