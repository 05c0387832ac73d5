#include "bake_cone.glsl"

// The least keys of a packet: of 2 x 2 owners, which share a search. What vectors of four have of owners is in the
// order (0, 0), (1, 0), (0, 1), (1, 1). On a device without doubles a ratio is at most 70 ulps under that of the bakers
// in kernels/, and never above.

const float ABOVE_ALL = 2.0;

ivec2 owners_x;      // their columns
ivec2 owners_y;      // and rows
vec4 owner_heights;  // ABOVE_ALL: outside of the map
vec4 eyes;           // the same; ABOVE_ALL of owners that take no part in a round

// What targets have of their own: distances along the axes, in texels, and heights.
struct Targets {
  vec4 x;
  vec4 y;
  vec4 tops;  // NOTHING: there is none
};
Targets best;
vec4 keys;  // the best ones', in float
// Those that float cannot tell from the best. They wait until decide(), outside of the loops that search: where lanes
// run together, what stands in a branch may cost as much as if all took it.
Targets unsure;

vec4 found;  // the ratios of the search that this one goes on with; or WIDE

// The 2 x 2 texels that were looked at last: where the first one is, as owners see it, and their heights.
ivec2 looked_first;
vec4 looked_tops;

// And those of them, bit 4 i + k for texel i and owner k, that float cannot tell from one another or from another one
// that waits.
uint undecided;

// From owners' columns (axis 0) or rows to boxes whose middles are at the offsets, and that reach `reach` to both
// sides. The including file defines it.
vec2 distances_along(int axis, vec2 offsets, float reach);

ivec2 first_texel() { return 2 * own_texel(); }
ivec2 last_texel() { return min(first_texel() + 1, sides - 1); }
// The texel whose ratio is an owner's, and the one that looks for it.
ivec2 texel_of(int owner) { return first_texel() + ivec2(owner & 1, owner >> 1); }
ivec2 owner_at(int owner) {
  return ivec2((owner & 1) == 0 ? owners_x.x : owners_x.y, owner < 2 ? owners_y.x : owners_y.y);
}

// v[i]. Indices that only a device knows would have it keep vectors in memory.
float component(vec4 v, int i) {
  vec2 pair = i < 2 ? v.xy : v.zw;
  return (i & 1) == 0 ? pair.x : pair.y;
}

// first, last: corners that are owners
void start(ivec2 first, ivec2 last) {
  owners_x = ivec2(first.x, last.x);
  owners_y = ivec2(first.y, last.y);
  keys = vec4(bake.widest_in_rows);
  best = Targets(vec4(0.0), vec4(0.0), vec4(NOTHING));
  unsure = best;
  undecided = 0u;
  for (int k = 0; k < 4; ++k) owner_heights[k] = is_outside(texel_of(k)) ? ABOVE_ALL : height_at(owner_at(k));
  eyes = owner_heights;
  found = vec4(WIDE);
}

bvec4 both(bvec4 a, bvec4 b) { return mix(bvec4(false), a, b); }
bvec4 either(bvec4 a, bvec4 b) { return mix(a, bvec4(true), b); }

vec4 limits() { return keys * (1.0 + 2.0 * KEY_ERROR); }
vec4 distances2(vec4 x, vec4 y) { return aspect * x * x + y * y; }

void take(inout Targets targets, Targets others, bvec4 where) {
  targets.x = mix(targets.x, others.x, where);
  targets.y = mix(targets.y, others.y, where);
  targets.tops = mix(targets.tops, others.tops, where);
}

// Offers owners the texels that were looked at, whose keys are these, or WIDE.
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
  if (exact_distances) {
    bvec4 is_farther = greaterThanEqual(distances2(nearest.x, nearest.y), distances2(best.x, best.y));
    is_unsure = both(is_unsure, not(both(is_farther, equal(nearest.tops, best.tops))));
  }
  keys = mix(keys, least, is_better);
  bvec4 is_free = both(is_unsure, equal(unsure.tops, vec4(NOTHING)));
  take(unsure, nearest, is_free);
  vec4 other = mix(mix(offered[1], offered[0], is_low_right), mix(offered[3], offered[2], is_high_right), is_high);
  vec4 loser = mix(high, low, is_high);
  bvec4 has_second = either(lessThan(loser, limits()), lessThan(other, limits()));
  bvec4 has_more = either(both(is_unsure, not(is_free)), has_second);
  uvec4 mine = mix(uvec4(0u), uvec4(1u, 2u, 4u, 8u), has_more);
  for (int i = 0; i < 4; ++i) {
    uvec4 bits = mix(uvec4(0u), mine, lessThan(offered[i], limits()));
    undecided |= (bits.x | bits.y | bits.z | bits.w) << (4 * i);
  }
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
      bvec4 is_k = equal(ivec4(k), ivec4(0, 1, 2, 3));
      keys = mix(keys, vec4(float(key / weight_y)), is_k);
      take(best, looked, is_k);
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
