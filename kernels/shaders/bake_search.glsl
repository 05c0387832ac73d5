#include "bake_common.glsl"

// Branch and bound on the max pyramid, nearest child first, for bakers that ask over all higher texels for the least of
// a key. Boxes are pruned in float with a margin, and what remains is evaluated in double: see
// kernels/maps/cone_search.cpp. The including file defines pair_key.

// Two texels whose key may be under the least one found yet.
struct Pair {
  dvec2 offset;      // texels from the owner of the cone to the target or, under repeat, to its nearest image
  double distance2;  // in the unit of `bake`
  double target_height;
  double rise;  // target_height - owner_height, > 0
};

// returns: the pair's key, at least distance2 / rise^2; any value from least_key on where it is not under it
double pair_key(Pair pair);

const float FLOAT_MARGIN = 1.000004;            // over the rounding of a bound in float
const double DOUBLE_MARGIN = 1.000000000001lf;  // and in double

int pyramid;   // the one that is searched
ivec2 facing;  // signs of its quadrant; 0: all texels count
ivec2 owner;
double owner_height;
double least_key;
float limit;  // least_key in units of weight_y, rounded up

void set_least(double key) {
  least_key = key;
  limit = float(key / bake.weight_y) * FLOAT_MARGIN;
}

// Whether a key is so much over the least one that rounding cannot have made it so.
bool is_over_least(double distance2, double rise) { return distance2 > least_key * (rise * rise) * DOUBLE_MARGIN; }

// The texels from `from` to `to` along an axis, in the direction of `sign`, or the nearest way for 0; under repeat in
// (-side/2, side/2] then. Under clamp the target lies in that direction.
int offset(int from, int to, int side, int sign) {
  int d = to - from;
  if (!bake.repeats) return d;
  if (sign == 0 ? 2 * d > side : sign < 0 && d > 0) return d - side;
  if (sign == 0 ? 2 * d <= -side : sign > 0 && d < 0) return d + side;
  return d;
}

// The texels to the nearest of [low, high] along an axis, in the direction of `sign`, or either for 0.
float distance_to(int from, int low, int high, int side, int sign) {
  const float NEVER = 1e18;
  high = min(high, side - 1);  // beyond it is padding
  float around = bake.repeats ? float(side) : NEVER;
  float up = from > high ? float(low - from) + around : max(float(low - from), 0.0);
  float down = from < low ? float(from - high) + around : max(float(from - high), 0.0);
  return sign == 0 ? min(up, down) : (sign > 0 ? up : down);
}

// Per axis, the texels from the owner to a node.
vec2 distance_to_node(int level, ivec2 node) {
  ivec2 low = node << level;
  ivec2 high = low + (1 << level) - 1;
  return vec2(distance_to(owner.x, low.x, high.x, bake.size.x, facing.x),
              distance_to(owner.y, low.y, high.y, bake.size.y, facing.y));
}

// Whether a texel under this node may lower the least key.
bool may_improve(int level, ivec2 node) {
  float rise = node_at(pyramid, level, node) - float(owner_height);
  if (rise <= 0.0) return false;  // padding too
  vec2 d = distance_to_node(level, node);
  float distance2 = float(bake.weight_x / bake.weight_y) * d.x * d.x + d.y * d.y;
  return distance2 < limit * rise * rise + float(bake.slack / bake.weight_y);
}

void evaluate(ivec2 texel) {
  if (!may_improve(0, texel)) return;
  Pair pair;
  pair.target_height = double(node_at(pyramid, 0, texel));
  precise double rise = pair.target_height - owner_height;
  pair.rise = rise;
  pair.offset = dvec2(offset(owner.x, texel.x, bake.size.x, facing.x), offset(owner.y, texel.y, bake.size.y, facing.y));
  precise double distance2 =
      pair.offset.x * pair.offset.x * bake.weight_x + pair.offset.y * pair.offset.y * bake.weight_y - bake.slack;
  if (is_over_least(distance2, rise)) return;
  pair.distance2 = distance2;
  double key = pair_key(pair);
  if (key < least_key) set_least(key);
}

// Which of a node's children is the nearest to the owner: 0 or 1 along each axis.
ivec2 near_child(int level, ivec2 node) {
  vec2 first = distance_to_node(level - 1, 2 * node);
  vec2 second = distance_to_node(level - 1, 2 * node + 1);
  return ivec2(lessThan(second, first));
}

// The node to go on with after this one and all below it; a level over the root ends the search. No stack: a child's
// rank among its siblings follows from where the owner is.
void advance(inout int level, inout ivec2 node) {
  while (level < bake.root) {
    ivec2 parent = node >> 1;
    ivec2 near = near_child(level + 1, parent);
    ivec2 rank = (node & 1) ^ near;
    if (rank != ivec2(1)) {
      rank = rank.x == 0 ? ivec2(1, rank.y) : ivec2(0, 1);
      node = 2 * parent + (rank ^ near);
      return;
    }
    node = parent;
    level += 1;
  }
  level = bake.root + 1;
}

void search_pyramid() {
  int level = bake.root;
  ivec2 node = ivec2(0);
  while (level <= bake.root) {
    if (level == 0) {
      evaluate(node);
    } else if (may_improve(level, node)) {
      node = 2 * node + near_child(level, node);
      level -= 1;
      continue;
    }
    advance(level, node);
  }
}

void main() {
  owner = own_texel();
  if (any(greaterThanEqual(owner, bake.size))) return;
  owner_height = height_at(owner);
  set_least(bake.widest_key);
  for (pyramid = 0; pyramid < bake.pyramids; ++pyramid) {
    facing = bake.pyramids == 1 ? ivec2(0) : 1 - 2 * ivec2(pyramid & 1, pyramid >> 1);
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) evaluate(wrapped(owner + ivec2(x, y)));
    search_pyramid();
  }
  store_key(owner, least_key);
}
