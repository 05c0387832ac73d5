// Walking a ray through the nodes of a maximum pyramid in extra_map.
#include "cell.glsl"

// The ray in units of level 0's nodes: x(t) = o + d t.
struct Line {
  vec2 o;
  vec2 d;
};

// The node that the ray is about to cross, on one axis.
struct NodeAxis {
  int index;           // in its level
  float cell;          // of level 0, that the ray is about to cross; unwrapped
  float t_exit;        // > the t that was asked for
  bool leaves_parent;  // at t_exit the ray leaves the node of the next level too
};

struct Node {
  ivec2 index;
  vec2 cell;
  float t_exit;
  bool leaves_parent;
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

// first: the lowest node of level 0 under clamp; it and the last one go on for ever. Borders are numbered, never summed
// up, and the node ahead at the border's own t is the one beyond it: no gap, no standstill (see axis_border).
NodeAxis node_axis(float o, float d, float t, int side, int level, int first) {
  NodeAxis axis;
  int lowest = level == 0 ? first : 0;
  axis.cell = floor(o + d * t);
  axis_border(o, d, t, axis.cell);
  if (WRAP == WRAP_CLAMP) axis.cell = clamp(axis.cell, float(lowest), float(side - 1));
  int cell = int(axis.cell);
  int within = WRAP == WRAP_CLAMP ? cell : wrapped(cell, side);
  axis.index = ancestor(within, side, level);
  bool forward = d > 0.0;
  int border = exit_border(axis.index, side, level, forward);
  int parent = ancestor(max(within, 0), side, level + 1);
  axis.leaves_parent = border == exit_border(parent, side, level + 1, forward);
  bool for_ever = WRAP == WRAP_CLAMP && (forward ? border == side : border == lowest);
  axis.t_exit = d == 0.0 || for_ever ? INFINITE_T : (float(cell - within + border) - o) / d;
  return axis;
}

Node node_ahead(Line line, float t, int level, int first) {
  NodeAxis x = node_axis(line.o.x, line.d.x, t, map_size().x, level, first);
  NodeAxis y = node_axis(line.o.y, line.d.y, t, map_size().y, level, first);
  Node node;
  node.index = ivec2(x.index, y.index);
  node.cell = vec2(x.cell, y.cell);
  node.t_exit = min(x.t_exit, y.t_exit);
  node.leaves_parent = x.t_exit <= y.t_exit ? x.leaves_parent : y.leaves_parent;
  return node;
}

// The level to begin on, and the highest to climb to: nodes about a quarter as wide as the ray's whole way. Wider ones
// are too seldom passed over to be worth their fetch (rocks: 0 to 3 levels lower tried, 2 took the fewest).
int first_level(Line line) {
  int way = int(clamp(0.25 * max(abs(line.d.x), abs(line.d.y)), 1.0, 65536.0));
  return min(findMSB(way), findMSB(max(map_size().x, map_size().y)));
}

float node_height(Node node, int level, inout Hit hit) {
  hit.taps += 1;
  return texelFetch(extra_map, node.index, level).x;
}
