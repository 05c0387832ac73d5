#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"

// [VB22] algorithms 1 and 2 and the centre heuristic: 3 x 3 nodes on every level of a max pyramid, as
// kernels/bake_quick.cpp has them.

const double NEVER = 1e300lf;  // over every key; not every device keeps infinities

// A neighbour's distances from the texel along one axis, squared, in the unit of `bake`.
struct Side {
  double near2;  // to the node; NEVER: there is no such neighbour
  double far2;   // to the part of it that finer levels have not visited; NEVER: they have visited it all
  int node;
};

// Along one axis: the node of a texel, and its two neighbours.
struct Stop {
  int node;
  Side low;
  Side high;
};

int nodes_at(int level, int side) { return ((side - 1) >> level) + 1; }

// How far a texel's node and its two neighbours reach below and above the texel.
ivec2 block(int texel, int level, int side) {
  int node = texel >> level;
  int last = nodes_at(level, side) - 1;
  ivec2 extent = ivec2(texel - (max(0, node - 1) << level), min(side, (node + 2) << level) - 1 - texel);
  if (!bake.repeats || last == 0) return extent;
  if (node == 0) extent.x += side - (last << level);
  if (node == last) extent.y += 1 << level;
  return extent;
}

double squared(double texels, double weight) { return texels * texels * weight; }

Side neighbour(int texel, int node, int level, ivec2 visited, int side, double weight) {
  // A clamped axis is part of a ring so long that nothing is near round its other side.
  int ring = bake.repeats ? side : 4 * side;
  int first = node << level;
  int last = min(side, first + (1 << level)) - 1;
  if (bake.footpoint == FOOTPOINT_CENTRE) {
    int halves = abs(first + last - 2 * texel);
    double centre2 = squared(0.5lf * double(min(halves, 2 * ring - halves)), weight);
    return Side(centre2, centre2, node);
  }
  // The ways down from the texel to the node's texels; the ways up are what is left of the ring.
  int from = (texel - last + ring) % ring;
  int to = (texel - first + ring) % ring;
  double near2 = squared(double(min(from, ring - to)), weight);
  if (bake.footpoint == FOOTPOINT_NEAREST) return Side(near2, near2, node);
  int new_from = max(from, visited.x + 1);
  int new_to = min(to, ring - visited.y - 1);
  if (new_from > new_to) return Side(near2, NEVER, node);
  return Side(near2, squared(double(min(new_from, ring - new_to)), weight), node);
}

Stop stop_at(int texel, int level, int side, double weight) {
  int nodes = nodes_at(level, side);
  int node = texel >> level;
  ivec2 visited = level > 0 ? block(texel, level - 1, side) : ivec2(0);
  Stop stop = Stop(node, Side(NEVER, NEVER, node), Side(NEVER, NEVER, node));
  // Two nodes on a ring are neighbours once; one has none.
  if (bake.repeats ? nodes > 1 : node > 0)
    stop.low = neighbour(texel, (node + nodes - 1) % nodes, level, visited, side, weight);
  if (bake.repeats ? nodes > 2 : node + 1 < nodes)
    stop.high = neighbour(texel, (node + 1) % nodes, level, visited, side, weight);
  return stop;
}

double owner_height;
double key;

void lower(double distance2, int level, int column, int row) {
  const double MARGIN = 1.000000000001lf;  // over the rounding of a product that stands for a quotient
  precise double rise = double(node_at(0, level, ivec2(column, row))) - owner_height;
  if (rise <= 0.0lf) return;
  precise double shortened = distance2 - bake.slack;
  precise double rise2 = rise * rise;
  if (shortened < key * rise2 * MARGIN) key = min(key, divide(shortened, rise2));
}

// A corner neighbour is an L where the finer levels have visited a quarter of it: the nearer of its two arms.
double corner(Side column, Side row) { return min(column.near2 + row.far2, column.far2 + row.near2); }

void main() {
  ivec2 owner = own_texel();
  if (any(greaterThanEqual(owner, bake.size))) return;
  owner_height = height_at(owner);
  key = bake.widest_key;
  for (int level = 0; level < bake.root; ++level) {
    Stop column = stop_at(owner.x, level, bake.size.x, bake.weight_x);
    Stop row = stop_at(owner.y, level, bake.size.y, bake.weight_y);
    lower(column.low.far2, level, column.low.node, row.node);
    lower(column.high.far2, level, column.high.node, row.node);
    lower(row.low.far2, level, column.node, row.low.node);
    lower(row.high.far2, level, column.node, row.high.node);
    lower(corner(column.low, row.low), level, column.low.node, row.low.node);
    lower(corner(column.high, row.low), level, column.high.node, row.low.node);
    lower(corner(column.low, row.high), level, column.low.node, row.high.node);
    lower(corner(column.high, row.high), level, column.high.node, row.high.node);
  }
  store_key(owner, key);
}
