#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_shape.glsl"
#include "bake_cell.glsl"

bool is_interpolated = bake.is_interpolated;
double weight_x = bake.weight_x;
double weight_y = bake.weight_y;

// The distance to the nearest cell that is harmful to a texel: branch and bound on the pyramid of shapes, near child
// first, for every point that the texel stands for and every image of the map.

layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) readonly buffer Shapes { Shape shapes[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) writeonly buffer Radii { float radii[]; };

double owner_height;
double owner_floor;  // cells that rise are harmless from this height on

struct Node {
  int level;
  ivec2 place;
};
// At most three nodes wait on each of 13 levels, and one is open.
const int STACK = 40;
uint stack[STACK];
int waiting;

void push(Node node) {
  stack[waiting] = uint(node.level) << 28 | uint(node.place.y) << 14 | uint(node.place.x);
  waiting += 1;
}
Node pop() {
  waiting -= 1;
  uint bits = stack[waiting];
  return Node(int(bits >> 28), ivec2(bits & 0x3fffu, (bits >> 14) & 0x3fffu));
}

double highest_neighbour(ivec2 texel) {
  double highest = 0.0lf;
  for (int i = 0; i < 9; ++i) highest = max(highest, height_at(texel + ivec2(i % 3, i / 3) - 1));
  return highest;
}

double least_product(double low, double high, double low_slope, double high_slope) {
  precise double a = low * low_slope;
  precise double b = low * high_slope;
  precise double c = high * low_slope;
  precise double d = high * high_slope;
  return min(min(a, b), min(c, d));
}

// first: from the owner to the first cell of a node; size: of it
bool may_harm(Shape shape, double x, double y, double size) {
  if (shape.low_x == 0.0lf && shape.high_x == 0.0lf && shape.low_y == 0.0lf && shape.high_y == 0.0lf) return false;
  precise double gain =
      least_product(x, x + size, shape.low_x, shape.high_x) + least_product(y, y + size, shape.low_y, shape.high_y);
  if (gain >= 0.0lf && shape.low >= owner_floor) return false;
  precise double sight = gain - shape.high + owner_height;
  return sight < 0.0lf;
}

// (x, y): from the owner to the first texel of the cell, or of its image
bool is_harmful(ivec2 cell, double x, double y) {
  Corner corners[4];
  corners_of(cell, corners);
  bool rises = true;
  bool stays_in_sight = true;
  bool is_flat = true;
  for (int k = 0; k < 4; ++k) {
    Corner corner = corners[k];
    precise double gain = (x + double(k & 1)) * corner.slope_x + (y + double(k >> 1)) * corner.slope_y;
    precise double sight = gain - corner.height + owner_height;
    rises = rises && gain >= 0.0lf && corner.height >= owner_floor;
    stays_in_sight = stays_in_sight && sight >= 0.0lf;
    is_flat = is_flat && corner.slope_x == 0.0lf && corner.slope_y == 0.0lf;
  }
  return !rises && !stays_in_sight && !is_flat;
}

// Distance of 0 from a stretch of texels along an axis.
double gap(double first, double count) { return max(max(first, -(first + count)), 0.0lf); }

double distance2(double x, double y) {
  precise double squares = x * x * weight_x + y * y * weight_y;
  return squares;
}

// Where rays that a texel's values are interpolated for may start along an axis: on it, and at the edge of uv half a
// texel outside.
int starts(int texel, int side) {
  if (!is_interpolated || repeats) return 1;
  return 1 + int(texel == 0) + int(texel == side - 1);
}
double start_at(int texel, int start) {
  if (start == 0) return double(texel);
  return double(texel) + (start == 1 && texel == 0 ? -0.5lf : 0.5lf);
}

void main() {
  ivec2 owner = own_texel();
  if (is_outside(owner)) return;
  owner_height = height_at(owner);
  owner_floor = is_interpolated ? highest_neighbour(owner) : owner_height;
  int images = repeats ? 9 : 1;  // the map itself, then those beside it
  ivec2 all_starts = ivec2(starts(owner.x, sides.x), starts(owner.y, sides.y));
  double best = bake.side * bake.side;
  double from_x = 0.0lf;  // from the owner to the image's first cell
  double from_y = 0.0lf;
  waiting = 0;
  int image = -1;
  ivec2 start = ivec2(0);
  bool is_done = false;
  while (!is_done) {
    if (waiting == 0) {
      image += 1;
      if (image == images) {
        image = 0;
        start.x += 1;
      }
      if (start.x == all_starts.x) start = ivec2(0, start.y + 1);
      if (start.y == all_starts.y) {
        is_done = true;
        continue;
      }
      int row = (11 * image) >> 5;  // a third
      ivec2 offset = ivec2(image - 3 * row, row);
      offset -= 3 * (offset >> 1);  // 0, 1, -1
      from_x = double(first_cell() + offset.x * sides.x) - start_at(owner.x, start.x);
      from_y = double(first_cell() + offset.y * sides.y) - start_at(owner.y, start.y);
      push(Node(top_level, ivec2(0)));
    }
    Node node = pop();
    int side = LEAST_NODE << node.level;
    double size = double(side);
    double x = from_x + double(node.place.x * side);
    double y = from_y + double(node.place.y * side);
    if (distance2(gap(x, size), gap(y, size)) >= best) continue;
    if (!may_harm(shapes[shape_index(node.level, node.place)], x, y, size)) continue;
    if (node.level == 0) {
      for (int i = 0; i < LEAST_NODE * LEAST_NODE; ++i) {
        ivec2 cell = node.place * LEAST_NODE + ivec2(i % LEAST_NODE, i / LEAST_NODE);
        if (any(greaterThanEqual(cell, cells()))) continue;
        double cell_x = from_x + double(cell.x);
        double cell_y = from_y + double(cell.y);
        double found = distance2(gap(cell_x, 1.0lf), gap(cell_y, 1.0lf));
        if (found < best && is_harmful(cell + first_cell(), cell_x, cell_y)) best = found;
      }
      continue;
    }
    precise double middle_x = x + 0.5lf * size;
    precise double middle_y = y + 0.5lf * size;
    ivec2 near = ivec2(middle_x <= 0.0lf ? 1 : 0, middle_y <= 0.0lf ? 1 : 0);
    for (int child = 3; child >= 0; --child) {  // the near child is on top of the stack
      ivec2 place = 2 * node.place + (near ^ ivec2(child & 1, child >> 1));
      if (all(lessThan(place, nodes_at(node.level - 1)))) push(Node(node.level - 1, place));
    }
  }
  // As search() of bake_search.glsl does: not where the device left the loop.
  if (is_done) radii[index_of(owner)] = best > 0.0lf ? rounded_down(divide(square_root(best), bake.side)) : 0.0;
}
