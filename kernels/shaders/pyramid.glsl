// Walking a ray through the nodes of a maximum pyramid in extra_map.
#include "cell.glsl"

// The node that a path is about to cross; paths are in nodes of level 0.
struct Node {
  ivec2 index;  // in its level
  vec2 cell;    // of level 0, that the path is about to cross; unwrapped
  float t_exit;
  bool leaves_parent;  // at t_exit the path leaves the node of the next level too
};

int level_side(int side, int level) { return max(side >> level, 1); }

// The node of a level that holds node i of level 0, within a tile. The last one covers the rest of a side that halves
// unevenly; a node below the map (-1 at level 0) has its own.
int ancestor(int i, int side, int level) { return min(i >> level, level_side(side, level) - 1); }

// Where a ray leaves a node, in nodes of level 0.
int exit_border(int node, int side, int level, bool forward) {
  if (!forward) return node << level;
  return node == level_side(side, level) - 1 ? side : (node + 1) << level;
}

// One axis of a node within a tile.
struct NodeAxis {
  int index;
  int border;  // where the path leaves it, in nodes of level 0
  bool leaves_parent;
  bool is_endless;
};

// within: the node of level 0. lowest: the first under clamp; it and the last one go on for ever
NodeAxis node_axis(int within, int side, int level, int lowest, bool forward) {
  NodeAxis axis;
  axis.index = ancestor(within, side, level);
  axis.border = exit_border(axis.index, side, level, forward);
  axis.leaves_parent = axis.border == exit_border(ancestor(max(within, 0), side, level + 1), side, level + 1, forward);
  axis.is_endless = WRAP == WRAP_CLAMP && axis.border == (forward ? side : lowest);
  return axis;
}

// first: the lowest node of level 0 under clamp. Borders are numbered, never summed up, and the node ahead at the
// border's own t is the one beyond it: no gap, no standstill (see index_ahead).
Node node_ahead(Path path, float t, int level, int first) {
  ivec2 side = map_size();
  int lowest = level == 0 ? first : 0;
  vec2 cell = index_ahead(path, t);
  if (WRAP == WRAP_CLAMP) cell = clamp(cell, vec2(lowest), vec2(side - 1));
  ivec2 within = WRAP == WRAP_CLAMP ? ivec2(cell) : wrapped(ivec2(cell), side);
  NodeAxis x = node_axis(within.x, side.x, level, lowest, path.way.x > 0.0);
  NodeAxis y = node_axis(within.y, side.y, level, lowest, path.way.y > 0.0);
  vec2 borders = (cell - vec2(within) + vec2(x.border, y.border) - path.o) * path.per_d;
  if (x.is_endless) borders.x = INFINITE_T;
  if (y.is_endless) borders.y = INFINITE_T;
  return Node(ivec2(x.index, y.index), cell, min(borders.x, borders.y),
              borders.x <= borders.y ? x.leaves_parent : y.leaves_parent);
}

// The level to begin on, and the highest to climb to: nodes about a quarter as wide as the ray's whole way. Wider ones
// are too seldom passed over to be worth their fetch (rocks: 0 to 3 levels lower tried, 2 took the fewest).
int first_level(Path path) {
  int way = int(clamp(0.25 * max(abs(path.d.x), abs(path.d.y)), 1.0, 65536.0));
  return min(findMSB(way), findMSB(max(map_size().x, map_size().y)));
}

float node_height(Node node, int level, inout Hit hit) {
  hit.taps += 1;
  return texelFetch(extra_map, node.index, level).x;
}
