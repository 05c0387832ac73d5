#include "bake_search.glsl"

// The least keys where one is that of its target alone. On a device without doubles a ratio is at most 70 ulps under
// that of the bakers in kernels/, and never above.

// What targets have of their own: distances along the axes, in texels, and heights.
struct Targets {
  vec4 x;
  vec4 y;
  vec4 tops;  // NOTHING: there is none
};
Targets best = Targets(vec4(0.0), vec4(0.0), vec4(NOTHING));
// Those that float cannot tell from the best. They wait until decide(), outside of the loops that search: where lanes
// run together, what stands in a branch may cost as much as if all took it.
Targets unsure = best;

vec4 found = vec4(WIDE);  // the ratios of the search that this one goes on with

// And those of them, bit 4 i + k for texel i and owner k, that float cannot tell from one another or from another one
// that waits.
uint undecided = 0u;

void take(inout Targets targets, Targets others, bvec4 where) {
  targets.x = mix(targets.x, others.x, where);
  targets.y = mix(targets.y, others.y, where);
  targets.tops = mix(targets.tops, others.tops, where);
}

void offer(vec4 offered[4], vec4 low_x, vec4 high_x, vec4 low_y, vec4 high_y) {
  bvec4 is_low_right = lessThan(offered[1], offered[0]);
  bvec4 is_high_right = lessThan(offered[3], offered[2]);
  vec4 low = mix(offered[0], offered[1], is_low_right);
  vec4 high = mix(offered[2], offered[3], is_high_right);
  bvec4 is_high = lessThan(high, low);
  bvec4 is_right = mix(is_low_right, is_high_right, is_high);
  vec4 least = mix(low, high, is_high);
  vec4 low_tops = mix(vec4(looked_tops[0]), vec4(looked_tops[1]), is_low_right);
  vec4 high_tops = mix(vec4(looked_tops[2]), vec4(looked_tops[3]), is_high_right);
  Targets nearest =
      Targets(mix(low_x, high_x, is_right), mix(low_y, high_y, is_high), mix(low_tops, high_tops, is_high));
#ifdef HAS_DOUBLES
  bvec4 is_better = lessThan(least, keys * (1.0 - 2.0 * KEY_ERROR));
  bvec4 is_unsure = both(lessThan(least, limits()), not(is_better));
  bvec4 is_farther = both(equal(nearest.x, best.x), equal(nearest.y, best.y));
  if (exact_distances) is_farther = greaterThanEqual(distances2(nearest.x, nearest.y), distances2(best.x, best.y));
  is_unsure = both(is_unsure, not(both(is_farther, equal(nearest.tops, best.tops))));
  keys = mix(keys, least, is_better);
  bvec4 is_free = both(is_unsure, equal(unsure.tops, vec4(NOTHING)));
  take(unsure, nearest, is_free);
  vec4 other = mix(mix(offered[1], offered[0], is_low_right), mix(offered[3], offered[2], is_high_right), is_high);
  vec4 loser = mix(high, low, is_high);
  bvec4 has_second = either(lessThan(loser, limits()), lessThan(other, limits()));
  bvec4 has_more = either(both(is_unsure, not(is_free)), has_second);
  for (int i = 0; i < 4; ++i) undecided |= bits_of(both(has_more, lessThan(offered[i], limits()))) << (4 * i);
#else
  bvec4 is_better = lessThan(least, keys);
  keys = mix(keys, least, is_better);
#endif
  take(best, nearest, is_better);
}

#ifdef HAS_DOUBLES
double square(float texels, double weight) { return double(texels) * double(texels) * weight; }

double key_of(float x, float y, float top, float height) {
  precise double distance2 = square(x, weight_x) + square(y, weight_y) - slack;
  precise double rise = double(top) - double(height);
  precise double rise2 = rise * rise;
  return divide(distance2, rise2);
}

double key_of(Targets targets, int k) {
  return key_of(component(targets.x, k), component(targets.y, k), component(targets.tops, k),
                component(owner_heights, k));
}

double least_key(int k) { return component(best.tops, k) == NOTHING ? widest_key : key_of(best, k); }

// One by one, in one loop: where lanes run together a loop is left when none has more to do, but no branch is skipped.
void decide() {
  const int OF_OWNERS = 16;  // bits from here on: those that wait for an owner
  bvec4 waits = notEqual(unsure.tops, vec4(NOTHING));
  uint left = undecided;
  for (int k = 0; k < 4; ++k)
    if (waits[k]) left |= 1u << (OF_OWNERS + k);
  while (left != 0u) {
    int bit = findLSB(left);
    left &= left - 1u;
    int k = bit & 3;
    int i = (bit >> 2) & 3;
    ivec2 offset = looked_first + ivec2(i & 1, i >> 1) - owner_at(k);
    vec2 along_x = distances_along(0, vec2(offset.x), 0.0);
    vec2 along_y = distances_along(1, vec2(offset.y), 0.0);
    Targets looked = Targets(along_x.xyxy, along_y.xyxy, vec4(component(looked_tops, i)));
    take(looked, unsure, bvec4(bit >= OF_OWNERS));
    double key = key_of(looked, k);
    if (key < least_key(k)) {
      keys = mix(keys, vec4(float(key / weight_y)), is_owner(k));
      take(best, looked, is_owner(k));
    }
  }
  undecided = 0u;
  unsure.tops = vec4(NOTHING);
}
#else
void decide() {}
#endif

// Goes on where another search ended: only keys that lower its ratios count.
void go_on() {
  for (int k = 0; k < 4; ++k) {
    ivec2 texel = texel_of(k);
    if (is_outside(texel)) continue;
    found[k] = ratios[layered(texel)];
    ratios[layered(texel)] = CUT_SHORT;
  }
  vec4 roots = found / bake.rows_to_ratio;
  keys = min(keys, roots * roots * (1.0 + KEY_ERROR));
}

void finish() {
  for (int k = 0; k < 4; ++k) {
    ivec2 texel = texel_of(k);
    if (is_outside(texel)) continue;
#ifdef HAS_DOUBLES
    float ratio = ratio_of(least_key(k));
#else
    float key = best.tops[k] == NOTHING ? bake.widest_in_rows : keys[k];
    float ratio = sqrt(key * (1.0 - 2.0 * KEY_ERROR)) * bake.rows_to_ratio;
#endif
    ratios[layered(texel)] = min(ratio, found[k]);
  }
}

// How many rounds begin with the packet's neighbours. The including file defines it.
int near_rounds();

// The texels of a packet and those round it, in blocks of 2 x 2.
const int NEAR_BLOCKS = 4;
void look_near(int block) {
  ivec2 first = ivec2(owners_x.x, owners_y.x) - 1 + 2 * ivec2(block & 1, block >> 1);
  vec4 tops;
  for (int i = 0; i < 4; ++i) {
    ivec2 texel = first + ivec2(i & 1, i >> 1);
    ivec2 end = repeats ? 2 * sides : sides;
    bool is_there = (repeats || all(greaterThanEqual(texel, ivec2(0)))) && all(lessThan(texel, end));
    tops[i] = is_there ? node_at(pyramid, 0, wrapped(texel)) : NOTHING;
  }
  look(first, 1, tops);
}

// Makes all rounds, then stores the ratios. Not where a device leaves loops before their end, as llvmpipe does after
// 65,535 turns of all of them together: that leaves CUT_SHORT in their places.
void search() {
  for (int i = 0; i < near_rounds() * NEAR_BLOCKS; ++i) {
    start_round(i / NEAR_BLOCKS);
    look_near(i % NEAR_BLOCKS);
    undecided = 0u;  // they are only where to begin, and are looked at again
  }
  Branch at;
  start_search();
  bool is_done = false;
  while (!is_done || undecided != 0u) {
    while (!is_done && undecided == 0u) {
      is_done = !next(at);
      if (!is_done) visit(at);
    }
    decide();
  }
  if (is_done && undecided == 0u) finish();
}
