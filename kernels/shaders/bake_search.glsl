// Branch and bound on the max pyramid, near child first, for bakers that ask over all higher texels for the least of a
// key: see kernels/maps/cone_search.cpp. The including file defines try_texel and finish.

int pyramid;   // the one that is searched
ivec2 facing;  // signs of its quadrant; 0: all texels count

// A texel of the height `top` whose distance and rise alone would lower the key. texels: to it along the axes
void try_texel(ivec2 texel, vec2 texels, float top);
// Stores the owner's ratio.
void finish(ivec2 owner);

// distance_to, in the direction of `sign` alone unless that is 0.
float distance_towards(float offset, float reach, float side, int sign) {
  if (sign == 0) return distance_to(offset, reach, side);
  const float NEVER = 1e9;
  float first = float(sign) * offset - reach;
  float last = float(sign) * offset + reach;
  if (first >= 0.0) return first;
  if (last >= 0.0) return 0.0;
  return bake.repeats ? max(first + side, 0.0) : NEVER;
}

// Of one level of the pyramid, where the search is.
struct Branch {
  int level;
  ivec2 quad;
};

// The nodes of a quad that may lower the key, a bit each.
struct Promising {
  uint nodes;
  uint near;  // the node that is nearest
};

Promising look(Branch at) {
  vec4 tops = quads[quad_index(pyramid, at.level, at.quad)];
  float size = float(1 << (at.level - 1));
  float reach = 0.5 * (size - 1.0);
  vec2 side = vec2(bake.size);
  vec2 first = vec2(2 * at.quad) * size + reach - vec2(owner);
  vec2 x = vec2(distance_towards(first.x, reach, side.x, facing.x),
                distance_towards(first.x + size, reach, side.x, facing.x));
  vec2 y = vec2(distance_towards(first.y, reach, side.y, facing.y),
                distance_towards(first.y + size, reach, side.y, facing.y));
  vec2 x2 = bake.aspect * x * x;
  vec2 y2 = y * y;
  vec4 rise = max(tops - owner_height, 0.0);
  vec4 slack = bake.slack_in_rows * vec4(greaterThan(rise, vec4(0.0)));
  bvec4 may_improve = lessThan(vec4(x2 + y2.x, x2 + y2.y), limit * rise * rise + slack);
  if (at.level == 1) {
    if (may_improve.x) try_texel(2 * at.quad, vec2(x.x, y.x), tops.x);
    if (may_improve.y) try_texel(2 * at.quad + ivec2(1, 0), vec2(x.y, y.x), tops.y);
    if (may_improve.z) try_texel(2 * at.quad + ivec2(0, 1), vec2(x.x, y.y), tops.z);
    if (may_improve.w) try_texel(2 * at.quad + ivec2(1, 1), vec2(x.y, y.y), tops.w);
    return Promising(0u, 0u);
  }
  uvec4 bits = uvec4(may_improve) << uvec4(0, 1, 2, 3);
  return Promising(bits.x | bits.y | bits.z | bits.w, uint(x.y < x.x) | (uint(y.y < y.x) << 1));
}

// The same nodes, node n at bit n ^ near.
uint by_rank(Promising promising) {
  uint nodes = promising.nodes;
  if ((promising.near & 1u) != 0u) nodes = ((nodes & 5u) << 1) | ((nodes >> 1) & 5u);
  if ((promising.near & 2u) != 0u) nodes = ((nodes & 3u) << 2) | (nodes >> 2);
  return nodes;
}

// What waits on the levels above: four bits a level, those of the lowest lowest.
uvec2 waiting;
uint nears;  // two bits a level

void drop_levels(uint levels) {
  uint bits = 4u * levels;
  waiting.x = bits < 32u ? (waiting.x >> bits) | (bits == 0u ? 0u : waiting.y << (32u - bits)) : waiting.y;
  waiting.y = bits < 32u ? waiting.y >> bits : 0u;
  nears >>= 2u * levels;
}

// The next quad to look at; false: there is none.
bool next(inout Branch at) {
  if (waiting.x == 0u) {
    if (waiting.y == 0u) return false;
    drop_levels(8u);
    at.quad >>= 8;
    at.level += 8;
  }
  uint done = uint(findLSB(waiting.x)) >> 2;  // levels without any
  drop_levels(done);
  at.quad >>= int(done);
  at.level += int(done);
  uint rank = uint(findLSB(waiting.x & 15u));
  waiting.x &= waiting.x - 1u;
  uint node = rank ^ (nears & 3u);
  at.quad = 2 * at.quad + ivec2(node & 1u, node >> 1);
  at.level -= 1;
  return true;
}

void try_neighbours() {
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) {
      ivec2 texel = wrapped(owner + ivec2(x, y));
      vec2 offset = vec2(texel - owner);
      vec2 texels = vec2(distance_towards(offset.x, 0.0, float(bake.size.x), facing.x),
                         distance_towards(offset.y, 0.0, float(bake.size.y), facing.y));
      try_texel(texel, texels, node_at(pyramid, 0, texel));
    }
}

Branch start_pyramid() {
  facing = bake.pyramids == 1 ? ivec2(0) : 1 - 2 * ivec2(pyramid & 1, pyramid >> 1);
  try_neighbours();
  waiting = uvec2(0u);
  nears = 0u;
  return Branch(bake.top_level, ivec2(0));
}

// Searches all pyramids, then stores the ratio. It is stored within the loop, by a turn of its own: a device that
// leaves loops before their end, as llvmpipe does after 65,535 turns of all of them together, leaves CUT_SHORT in its
// place.
void search() {
  pyramid = 0;
  Branch at = start_pyramid();
  for (bool has_more = true;;) {
    if (!has_more) {
      pyramid += 1;
      if (pyramid == bake.pyramids) {
        finish(owner);
        return;
      }
      at = start_pyramid();
    }
    Promising promising = look(at);
    waiting = uvec2((waiting.x << 4) | by_rank(promising), (waiting.y << 4) | (waiting.x >> 28));
    nears = (nears << 2) | promising.near;
    has_more = next(at);
  }
}
