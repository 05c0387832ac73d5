#include "bake_best.glsl"

// Branch and bound on the max pyramid, near child first, for bakers that ask over all higher texels for the least of a
// key: see kernels/maps/cone_search.cpp. It is made in turns, of a pyramid or an image of the map each. The including
// file defines the functions that are only declared here. What can be decided later stands outside of the innermost
// loop: llvmpipe skips no branch, and runs both sides of each for all of its lanes.

int pyramid;   // the one that is searched
ivec2 origin;  // where the image of the map begins that is searched

int turns();
// How many of them begin with the owner's neighbours.
int near_turns();
// Chooses a turn's pyramid and image.
void start_turn(int turn);
// From the owner to a box whose middle is `offset` away along an axis, and that reaches `reach` to both sides.
float distance_along(int axis, float offset, float reach);
// Of a quad's nodes, of `size` texels a side, whether any texel counts of each. first: of all texels; offset: to it
// from the owner
bvec4 counts(ivec2 first, ivec2 offset, int size);

// Of one level of the pyramid, where the search is; on level 0 the owner's neighbours.
struct Branch {
  int level;
  ivec2 quad;
};
const Branch NEIGHBOURS = Branch(0, ivec2(0));

Branch looked;  // at last

Target target_at(ivec2 texel, ivec2 offset) {
  vec2 texels = vec2(distance_along(0, float(offset.x), 0.0), distance_along(1, float(offset.y), 0.0));
  return Target(Arms(texels, texels), node_at(pyramid, 0, texel));
}

ivec2 neighbour_offset(int i) { return ivec2(i % 3, i / 3) - 1; }

Target target(int i) {
  if (looked == NEIGHBOURS) return target_at(wrapped(owner + neighbour_offset(i)), neighbour_offset(i));
  ivec2 texel = 2 * looked.quad + ivec2(i & 1, i >> 1);
  return target_at(texel, texel + origin - owner);
}

void look_at_neighbours() {
  looked = NEIGHBOURS;
  for (int i = 0; i < 9; ++i) {
    ivec2 offset = neighbour_offset(i);
    ivec2 texel = wrapped(owner + offset);
    bool is_there = repeats || texel == owner + offset;
    if (is_there && counts(texel, offset, 1).x) offer(i, target_at(texel, offset));
  }
}

// The nodes of a quad that may lower the key, a bit each.
struct Promising {
  uint nodes;
  uint near;  // the node that is nearest
};

Promising look(Branch at) {
  looked = at;
  vec4 tops = texelFetch(quads, quad_index(pyramid, at.level, at.quad));
  int side = 1 << (at.level - 1);
  ivec2 first = at.quad << at.level;
  ivec2 offset = first + origin - owner;
  float size = float(side);
  float reach = 0.5 * (size - 1.0);
  vec2 middle = vec2(offset) + reach;
  vec2 x = vec2(distance_along(0, middle.x, reach), distance_along(0, middle.x + size, reach));
  vec2 y = vec2(distance_along(1, middle.y, reach), distance_along(1, middle.y + size, reach));
  vec2 x2 = aspect * x * x;
  vec2 y2 = y * y;
  vec4 rise = max(tops - owner_height, 0.0);
  vec4 widened = slack_in_rows * vec4(greaterThan(rise, vec4(0.0)));
  bvec4 is_near = lessThan(vec4(x2 + y2.x, x2 + y2.y), limit * rise * rise + widened);
  bvec4 may_improve = bvec4(uvec4(is_near) & uvec4(counts(first, offset, side)));
  if (at.level == 1) {
    for (int i = 0; i < 4; ++i) {
      vec2 texels = vec2(x[i & 1], y[i >> 1]);
      if (may_improve[i]) offer(i, Target(Arms(texels, texels), tops[i]));
    }
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

int turn;

// The next quad to look at; false: there is none.
bool next(inout Branch at) {
  if (waiting == uvec2(0u)) {
    turn += 1;
    if (turn == turns()) return false;
    start_turn(turn);
    at = Branch(top_level, ivec2(0));
    return true;
  }
  if (waiting.x == 0u) {
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

// Looks at a quad, and has those of its nodes wait that may lower the key.
void visit(Branch at) {
  Promising promising = look(at);
  waiting = uvec2((waiting.x << 4) | by_rank(promising), (waiting.y << 4) | (waiting.x >> 28));
  nears = (nears << 2) | promising.near;
}

// Makes all turns, then stores the ratio. Not where a device leaves loops before their end, as llvmpipe does after
// 65,535 turns of all of them together: that leaves CUT_SHORT in the ratio's place.
void search() {
  for (turn = 0; turn < near_turns(); ++turn) {
    start_turn(turn);
    look_at_neighbours();
    decide();
  }
  turn = -1;
  waiting = uvec2(0u);
  nears = 0u;
  Branch at;
  bool is_done = false;
  while (!is_done || undecided != 0u) {
    while (!is_done && undecided == 0u) {
      is_done = !next(at);
      if (!is_done) visit(at);
    }
    decide();
  }
  if (is_done && undecided == 0u) finish(own_texel());
}
