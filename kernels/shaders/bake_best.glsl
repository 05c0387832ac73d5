#include "bake_cone.glsl"

// The best of all targets that are offered. On a device without doubles the ratio is at most 70 ulps under that of the
// bakers in kernels/, and never above.

// How far a target is along the axes, in texels. Where that has two answers, the target is the nearer of
// (near.x, far.y) and (far.x, near.y).
struct Arms {
  vec2 near;
  vec2 far;
};

struct Target {
  Arms arms;
  float top;  // its height
};

// Of those that were looked at last. The including file defines it.
Target target(int i);

ivec2 owner;  // the texel whose cone it is
float owner_height;
float limit;      // keys from here on are no better than the best
float low_limit;  // keys under this are better than the best
bool has_best;
Target best;
float best_distance2;

// Targets that float cannot tell from the best, a bit each. They wait until decide(), outside of the loops that search:
// where lanes run together, what stands in a branch may cost as much as if all took it.
uint undecided;

void set_limits(float key) {
  limit = key * (1.0 + 2.0 * KEY_ERROR);
  low_limit = key * (1.0 - 2.0 * KEY_ERROR);
}

float distance2_of(Arms arms) {
  vec2 near2 = arms.near * arms.near;
  vec2 far2 = arms.far * arms.far;
  return min(aspect * near2.x + far2.y, aspect * far2.x + near2.y) - slack_in_rows;
}

void start(ivec2 owner) {
  owner_height = height_at(owner);
  has_best = false;
  best_distance2 = bake.widest_in_rows;
  best.top = NOTHING;
  set_limits(bake.widest_in_rows);
  undecided = 0u;
}

void take(Target better) {
  float rise = better.top - owner_height;
  has_best = true;
  best = better;
  best_distance2 = distance2_of(better.arms);
  set_limits(best_distance2 / (rise * rise));
}

#ifdef HAS_DOUBLES
double square(float texels, double weight) { return double(texels) * double(texels) * weight; }

double key_of(Target target) {
  Arms arms = target.arms;
  precise double one = square(arms.near.x, weight_x) + square(arms.far.y, weight_y);
  precise double other = square(arms.far.x, weight_x) + square(arms.near.y, weight_y);
  precise double distance2 = min(one, other) - slack;
  precise double rise = double(target.top) - double(owner_height);
  precise double rise2 = rise * rise;
  return divide(distance2, rise2);
}

double least_key() { return has_best ? key_of(best) : widest_key; }

void decide() {
  while (undecided != 0u) {
    Target waiting = target(findLSB(undecided));
    undecided &= undecided - 1u;
    if (key_of(waiting) < least_key()) take(waiting);
  }
}

void finish(ivec2 texel) { ratios[layered(texel)] = ratio_of(least_key()); }
#else
void decide() {}

void finish(ivec2 texel) { ratios[layered(texel)] = sqrt(low_limit) * bake.rows_to_ratio; }
#endif

// Of what is looked at, target(i).
void offer(int i, Target offered) {
  float rise = offered.top - owner_height;
  float rise2 = rise * rise;
  float distance2 = distance2_of(offered.arms);
  if (rise <= 0.0 || distance2 >= limit * rise2) return;
  if (distance2 < low_limit * rise2) {
    take(offered);
    return;
  }
#ifdef HAS_DOUBLES
  bool is_farther = exact_distances && offered.top == best.top && distance2 >= best_distance2;
  if (!is_farther) undecided |= 1u << i;
#else
  float best_rise = has_best ? best.top - owner_height : 1.0;
  if (distance2 * (best_rise * best_rise) < best_distance2 * rise2) take(offered);
#endif
}
