// Branch and bound on the max pyramid, near child first, for bakers that ask over all higher texels for the least of a
// key: see kernels/maps/cone_search.cpp. It is made in turns, of a pyramid or an image of the map each. The including
// file defines the functions that are only declared here.

int pyramid;   // the one that is searched
ivec2 origin;  // where the image of the map begins that is searched

int turns();
// Chooses a turn's pyramid and image, and tries the owner's neighbours.
void start_turn(int turn);
// From the owner to a box whose middle is `offset` away along an axis, and that reaches `reach` to both sides.
float distance_along(int axis, float offset, float reach);
// Whether any texel counts of a box of `size` texels a side. first: of its texels; offset: from the owner to its middle
bool counts(ivec2 first, float size, vec2 offset);
// A texel of the height `top` whose distance and rise alone would lower the key. texels: to it along the axes
void try_texel(ivec2 texel, vec2 texels, float top);
// Stores the ratio that was found, as that of a texel.
void finish(ivec2 texel);

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
  vec2 first = vec2(2 * at.quad) * size + reach - vec2(owner - origin);
  vec2 x = vec2(distance_along(0, first.x, reach), distance_along(0, first.x + size, reach));
  vec2 y = vec2(distance_along(1, first.y, reach), distance_along(1, first.y + size, reach));
  vec2 x2 = bake.aspect * x * x;
  vec2 y2 = y * y;
  vec4 rise = max(tops - owner_height, 0.0);
  vec4 slack = bake.slack_in_rows * vec4(greaterThan(rise, vec4(0.0)));
  bvec4 may_improve = lessThan(vec4(x2 + y2.x, x2 + y2.y), limit * rise * rise + slack);
  ivec2 texel = 2 * at.quad * int(size);
  for (int i = 0; i < 4; ++i) {
    ivec2 node = ivec2(i & 1, i >> 1);
    if (may_improve[i]) may_improve[i] = counts(texel + node * int(size), size, first + vec2(node) * size);
  }
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

Branch start_branch(int turn) {
  start_turn(turn);
  waiting = uvec2(0u);
  nears = 0u;
  return Branch(bake.top_level, ivec2(0));
}

// Makes all turns, then stores the ratio. It is stored within the loop, by a turn of its own: a device that
// leaves loops before their end, as llvmpipe does after 65,535 turns of all of them together, leaves CUT_SHORT in its
// place.
void search() {
  int turn = 0;
  Branch at = start_branch(turn);
  for (bool has_more = true;;) {
    if (!has_more) {
      turn += 1;
      if (turn == turns()) {
        finish(own_texel());
        return;
      }
      at = start_branch(turn);
    }
    Promising promising = look(at);
    waiting = uvec2((waiting.x << 4) | by_rank(promising), (waiting.y << 4) | (waiting.x >> 28));
    nears = (nears << 2) | promising.near;
    has_more = next(at);
  }
}
