#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_best.glsl"

// [VB22] algorithms 1 and 2, the latter also as published, and the centre heuristic: 3 x 3 nodes on every level of a
// max pyramid, as kernels/maps/bake_quick.cpp has them.

const float UNREACHED = 1e18;

// A node's distances from a texel along one axis, in texels.
struct Side {
  float near;  // to the node; UNREACHED: there is no such neighbour
  float far;   // to the part of it that finer levels have not visited; UNREACHED: they have visited it all
  int node;
};

// Along one axis: the node of a texel, and its two neighbours.
struct Stop {
  int node;
  Side low;
  Side high;
};

// How far a texel's node and its two neighbours reach below and above the texel.
ivec2 block(int texel, int level, int side) {
  int node = texel >> level;
  int last = (side - 1) >> level;
  ivec2 extent = ivec2(texel - (max(0, node - 1) << level), min(side, (node + 2) << level) - 1 - texel);
  if (!repeats || last == 0) return extent;
  if (node == 0) extent.x += side - (last << level);
  if (node == last) extent.y += 1 << level;
  return extent;
}

Side neighbour(int texel, int node, int level, ivec2 visited, int side) {
  // A clamped axis is part of a ring so long that nothing is near round its other side.
  int ring = repeats ? side : 4 * side;
  int first = node << level;
  int last = min(side, first + (1 << level)) - 1;
#if FOOTPOINT == FOOTPOINT_CENTRE
  int halves = abs(first + last - 2 * texel);
  float centre = 0.5 * float(min(halves, 2 * ring - halves));
  return Side(centre, centre, node);
#else
  // The ways down from the texel to the node's texels; the ways up are what is left of the ring.
  int from = texel >= last ? texel - last : texel - last + ring;
  int to = texel >= first ? texel - first : texel - first + ring;
  float near = float(min(min(from, ring - from), min(to, ring - to)));
#if FOOTPOINT == FOOTPOINT_NEAREST
  return Side(near, near, node);
#else
  int new_from = max(from, visited.x + 1);
  int new_to = min(to, ring - visited.y - 1);
  if (new_from > new_to) return Side(near, UNREACHED, node);
  return Side(near, float(min(min(new_from, ring - new_from), min(new_to, ring - new_to))), node);
#endif
#endif
}

Stop stop_at(int texel, int level, int side) {
  int last = (side - 1) >> level;
  int node = texel >> level;
  ivec2 visited = level > 0 ? block(texel, level - 1, side) : ivec2(0);
  Stop stop = Stop(node, Side(UNREACHED, UNREACHED, node), Side(UNREACHED, UNREACHED, node));
  // Two nodes on a ring are neighbours once; one has none.
  if (repeats ? last > 0 : node > 0) stop.low = neighbour(texel, node > 0 ? node - 1 : last, level, visited, side);
  if (repeats ? last > 1 : node < last) stop.high = neighbour(texel, node < last ? node + 1 : 0, level, visited, side);
  return stop;
}

// The level that is looked at, and what lies there round the owner.
int level;
Stop column;
Stop row;

Side side_of(Stop stop, int i) {
  if (i == 0) return stop.low;
  return i == 1 ? Side(0.0, 0.0, stop.node) : stop.high;
}

#if FOOTPOINT == FOOTPOINT_PUBLISHED
bool is_nearer(vec2 a, vec2 b) {
#ifdef HAS_DOUBLES
  return square(a.x, weight_x) + square(a.y, weight_y) < square(b.x, weight_x) + square(b.y, weight_y);
#else
  return aspect * a.x * a.x + a.y * a.y < aspect * b.x * b.x + b.y * b.y;
#endif
}

// PublishedArm (kernels/maps/bake_quick.cpp).
Arms arms_of_corner(int i, vec2 near, vec2 far) {
  const int LOW_LOW = 0;
  const int LOW_HIGH = 6;
  vec2 columns = vec2(far.x, near.y);
  vec2 rows = vec2(near.x, far.y);
  if (i == LOW_LOW && is_nearer(columns, rows)) columns = rows;
  bool is_published = i == LOW_LOW ? max(far.x, far.y) < UNREACHED : i == LOW_HIGH && far.x < UNREACHED;
  return is_published ? Arms(columns, columns) : Arms(near, far);
}
#else
Arms arms_of_corner(int i, vec2 near, vec2 far) { return Arms(near, far); }
#endif

// A corner neighbour is an L where the finer levels have visited a quarter of it: the nearer of its two arms. Others
// are what those have not visited of them.
Target target(int i) {
  Side x = side_of(column, i % 3);
  Side y = side_of(row, i / 3);
  vec2 far = vec2(x.far, y.far);
  bool is_corner = i % 3 != 1 && i / 3 != 1;
  Arms arms = is_corner ? arms_of_corner(i, vec2(x.near, y.near), far) : Arms(far, far);
  return Target(arms, node_at(0, level, ivec2(x.node, y.node)));
}

void main() {
  owner = own_texel();
  if (is_outside(owner)) return;
  start(owner);
  level = -1;
  for (bool has_more = true; has_more || undecided != 0u;) {
    while (has_more && undecided == 0u) {
      level += 1;
      column = stop_at(owner.x, level, sides.x);
      row = stop_at(owner.y, level, sides.y);
      for (int i = 0; i < 9; ++i)
        if (i != 4) offer(i, target(i));
      has_more = level + 1 < top_level;
    }
    decide();
  }
  finish(owner);
}
