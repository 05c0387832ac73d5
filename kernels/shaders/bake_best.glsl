#include "bake_cone.glsl"

// The best of all targets that are offered. On a device without doubles the ratio is at most 70 ulps under that of the
// bakers in kernels/, and never above.

// How far a target is along the axes, in texels. Where that has two answers, the target is the nearer of
// (near.x, far.y) and (far.x, near.y).
struct Arms {
  vec2 near;
  vec2 far;
};

float low_limit;  // keys under this are better than the best
bool has_best;
Arms best_arms;
float best_distance2;
float best_top;

void set_limits(float key) {
  limit = key * (1.0 + 2.0 * KEY_ERROR);
  low_limit = key * (1.0 - 2.0 * KEY_ERROR);
}

void start(ivec2 owner) {
  owner_height = height_at(owner);
  has_best = false;
  best_distance2 = bake.widest_in_rows;
  best_top = NOTHING;
  set_limits(bake.widest_in_rows);
}

float distance2_of(Arms arms) {
  vec2 near2 = arms.near * arms.near;
  vec2 far2 = arms.far * arms.far;
  return min(bake.aspect * near2.x + far2.y, bake.aspect * far2.x + near2.y) - bake.slack_in_rows;
}

#ifdef HAS_DOUBLES
double square(float texels, double weight) { return double(texels) * double(texels) * weight; }

double key_of(Arms arms, float top) {
  precise double one = square(arms.near.x, bake.weight_x) + square(arms.far.y, bake.weight_y);
  precise double other = square(arms.far.x, bake.weight_x) + square(arms.near.y, bake.weight_y);
  precise double distance2 = min(one, other) - bake.slack;
  precise double rise = double(top) - double(owner_height);
  precise double rise2 = rise * rise;
  return divide(distance2, rise2);
}

double least_key() { return has_best ? key_of(best_arms, best_top) : bake.widest_key; }

// For a key between the limits.
bool is_better(Arms arms, float distance2, float top) {
  if (bake.exact_distances && top == best_top && distance2 >= best_distance2) return false;
  return key_of(arms, top) < least_key();
}

void finish(ivec2 texel) { store_key(texel, least_key()); }
#else
bool is_better(Arms arms, float distance2, float top) {
  float rise = top - owner_height;
  float best_rise = has_best ? best_top - owner_height : 1.0;
  return distance2 * (best_rise * best_rise) < best_distance2 * (rise * rise);
}

void finish(ivec2 texel) { ratios[layered(texel)] = sqrt(low_limit) * bake.rows_to_ratio; }
#endif

// A target as high as `top`, at the distance2 of its arms.
void offer(Arms arms, float distance2, float top) {
  float rise = top - owner_height;
  float rise2 = rise * rise;
  if (rise <= 0.0 || distance2 >= limit * rise2) return;
  if (distance2 >= low_limit * rise2 && !is_better(arms, distance2, top)) return;
  has_best = true;
  best_arms = arms;
  best_distance2 = distance2;
  best_top = top;
  set_limits(distance2 / rise2);
}
