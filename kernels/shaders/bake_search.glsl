#include "bake_packet.glsl"

// Branch and bound on the max pyramid, near child first, for bakers that ask over all higher texels for the least of a
// key: see kernels/maps/cone_search.cpp. It is made in rounds, each of all images of the map that have a texel near
// enough. The including file defines what is only declared here. What can be decided later stands outside of the
// innermost loop: llvmpipe skips no branch, and runs both sides of each for all of its lanes.
//
// SEES_IMAGES is defined where each image of a map that repeats is searched by itself; else distances are those round
// the torus.

const int FARTHEST_IMAGE = 2;  // along an axis: no nearest texel within a wedge is farther away

int pyramid;              // the one that is searched
ivec2 origin = ivec2(0);  // where the image of the map begins that is searched

int rounds();
// Chooses a round's pyramid, the directions and the owners that take part.
void start_round(int round);
// Of a node of `size` texels a side, whether any texel counts for each owner. first: of all its texels; x, y: to it
// from the owners' columns and rows
bvec4 counts(ivec2 first, ivec2 x, ivec2 y, int size);

// Of one level of the pyramid, where the search is.
struct Branch {
  int level;
  ivec2 quad;
};

// The nodes of a quad that may lower a key, a bit each.
struct Promising {
  uint nodes;
  uint near;  // the node that is nearest
};

// Offers owners the texels that were looked at, whose keys are these, or WIDE. low_x ...: distances to their columns
// and rows
void offer(vec4 offered[4], vec4 low_x, vec4 high_x, vec4 low_y, vec4 high_y);

// Looks at four nodes of so many texels a side, of which single ones are offered. first: texel of the first node
Promising look(ivec2 first, int side, vec4 tops) {
  looked_first = first + origin;
  looked_tops = tops;
  ivec2 offsets_x = looked_first.x - owners_x;
  ivec2 offsets_y = looked_first.y - owners_y;
  float size = float(side);
  float reach = 0.5 * (size - 1.0);
  vec2 middles_x = vec2(offsets_x) + reach;
  vec2 middles_y = vec2(offsets_y) + reach;
  vec4 low_x = distances_along(0, middles_x, reach).xyxy;
  vec4 high_x = distances_along(0, middles_x + size, reach).xyxy;
  vec4 low_y = distances_along(1, middles_y, reach).xxyy;
  vec4 high_y = distances_along(1, middles_y + size, reach).xxyy;
  vec4 offered[4];
  uint nodes = 0u;
  for (int i = 0; i < 4; ++i) {
    ivec2 place = side * ivec2(i & 1, i >> 1);
    vec4 square = distances2((i & 1) == 0 ? low_x : high_x, i < 2 ? low_y : high_y);
    vec4 rises = max(tops[i] - eyes, 0.0);
    vec4 rises2 = rises * rises;
    vec4 widened = mix(vec4(0.0), vec4(slack_in_rows), greaterThan(rises, vec4(0.0)));
    bvec4 is_near = lessThan(square, limits() * rises2 + widened);
    bvec4 may_improve = both(is_near, counts(first + place, offsets_x + place.x, offsets_y + place.y, side));
    if (any(may_improve)) nodes |= 1u << i;
    offered[i] = mix(vec4(WIDE), (square - slack_in_rows) / rises2, may_improve);
  }
  uint near = uint(high_x.x < low_x.x) | (uint(high_y.x < low_y.x) << 1);
  if (side > 1) return Promising(nodes, near);
  offer(offered, low_x, high_x, low_y, high_y);
  return Promising(0u, near);
}

Promising look(Branch at) {
  vec4 tops = texelFetch(quads, quad_index(pyramid, at.level, at.quad));
  return look(at.quad << at.level, 1 << (at.level - 1), tops);
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

// The images of the map that have a texel that may lower a key, and where the search of each begins.
ivec2 low_image;
ivec2 high_image;
Branch start_of_image;

int round_number;
ivec2 image;

// How far from an owner a texel can be that lowers its key, none being higher than any pyramid's top.
int reach_of_owners() {
  float top = 0.0;
  for (int i = 0; i < bake.pyramids; ++i) {
    vec4 tops = texelFetch(quads, quad_index(i, top_level, ivec2(0)));
    top = max(top, max(max(tops.x, tops.y), max(tops.z, tops.w)));
  }
  vec4 rises = max(top - owner_heights, 0.0);
  vec4 distances2 = limits() * rises * rises + slack_in_rows;
  float distance2 = max(max(distances2.x, distances2.y), max(distances2.z, distances2.w));
  return int(min(sqrt(distance2 / min(aspect, 1.0)), 1e6)) + 1;
}

ivec2 image_at(ivec2 texel) { return ivec2(floor((vec2(texel) + 0.5) / vec2(sides))); }

// The smallest quad that has all texels that may lower a key, where they are in one image of the map.
void find_start() {
  int reach = reach_of_owners();
  ivec2 low = ivec2(min(owners_x.x, owners_x.y), min(owners_y.x, owners_y.y)) - reach;
  ivec2 high = ivec2(max(owners_x.x, owners_x.y), max(owners_y.x, owners_y.y)) + reach;
  low_image = ivec2(0);
  high_image = ivec2(0);
  if (repeats) {
    low_image = max(image_at(low), -FARTHEST_IMAGE);
    high_image = min(image_at(high), FARTHEST_IMAGE);
  }
  low = max(low, ivec2(0));
  high = min(high, sides - 1);
  start_of_image = Branch(top_level, ivec2(0));
  if (low_image == high_image) {
    int level = max(findMSB((low.x ^ high.x) | (low.y ^ high.y)) + 1, 1);
    start_of_image = Branch(level, low >> level);
  }
#ifndef SEES_IMAGES
  low_image = ivec2(0);
  high_image = ivec2(0);
#endif
}

// The next quad to look at; false: there is none.
bool next(inout Branch at) {
  if (waiting == uvec2(0u)) {
    image.x += 1;
    if (image.x > high_image.x) image = ivec2(low_image.x, image.y + 1);
    if (image.y > high_image.y) {
      round_number += 1;
      if (round_number == rounds()) return false;
      start_round(round_number);
      image = low_image;
    }
    origin = image * sides;
    at = start_of_image;
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

// Looks at a quad, and has those of its nodes wait that may lower a key.
void visit(Branch at) {
  Promising promising = look(at);
  waiting = uvec2((waiting.x << 4) | by_rank(promising), (waiting.y << 4) | (waiting.x >> 28));
  nears = (nears << 2) | promising.near;
}

void start_search() {
  find_start();
  round_number = -1;
  image = high_image;
  waiting = uvec2(0u);
  nears = 0u;
}
