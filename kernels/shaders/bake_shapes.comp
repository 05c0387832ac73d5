#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_shape.glsl"
#include "bake_cell.glsl"

// One level of the pyramid of shapes; `argument` says which. With the first level, all radii become CUT_SHORT, for the
// search that follows.

layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) buffer Shapes { Shape shapes[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) writeonly buffer Radii { float radii[]; };

const double FAR = 1e300lf;

void add(inout Shape shape, Shape other) {
  shape.low = min(shape.low, other.low);
  shape.high = max(shape.high, other.high);
  shape.low_x = min(shape.low_x, other.low_x);
  shape.high_x = max(shape.high_x, other.high_x);
  shape.low_y = min(shape.low_y, other.low_y);
  shape.high_y = max(shape.high_y, other.high_y);
}

void main() {
  ivec2 node = own_texel();
  int level = argument;
  if (any(greaterThanEqual(node, nodes_at(level)))) return;
  Shape shape = Shape(FAR, -FAR, FAR, -FAR, FAR, -FAR);
  int children = level == 0 ? LEAST_NODE : 2;  // along an axis
  ivec2 end = level == 0 ? cells() : nodes_at(level - 1);
  for (int i = 0; i < children * children; ++i) {
    ivec2 child = node * children + ivec2(i % children, i / children);
    if (any(greaterThanEqual(child, end))) continue;
    if (level > 0) {
      add(shape, shapes[shape_index(level - 1, child)]);
      continue;
    }
    if (!is_outside(child)) radii[index_of(child)] = CUT_SHORT;
    Corner corners[4];
    corners_of(child + first_cell(), corners);
    for (int k = 0; k < 4; ++k) {
      Corner c = corners[k];
      add(shape, Shape(c.height, c.height, c.slope_x, c.slope_x, c.slope_y, c.slope_y));
    }
  }
  shapes[shape_index(level, node)] = shape;
}
