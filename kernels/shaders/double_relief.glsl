// Relief mapping of a solid: equal steps down the ray until one is between both surfaces, then refinement. A ray
// without such a step passes. [RTM] listing 5.3, RM_DOUBLEDEPTH
#define MAY_PASS
#include "refinement.glsl"

Hit trace(Ray ray) {
  Hit hit = Hit(1.0, STATUS_PASSED, 0, 0);
  float gap = gap_at(ray, 0.0, hit);
  Bracket bracket = Bracket(0.0, 0.0, gap, gap);
  if (gap <= 0.0) {  // it begins inside
    hit.status = STATUS_HIT;
    hit.t = 0.0;
    return hit;
  }
  for (int i = 1; i <= LINEAR_STEPS; ++i) {
    float t = float(i) / float(LINEAR_STEPS);
    gap = gap_at(ray, t, hit);
    hit.steps += 1;
    if (hit.status == STATUS_PASSED && gap <= 0.0) {
      bracket.hi = t;
      bracket.gap_hi = gap;
      hit.status = STATUS_HIT;
      if (LOOP == LOOP_EARLY_EXIT) break;
    }
    if (hit.status == STATUS_PASSED) {
      bracket.lo = t;
      bracket.gap_lo = gap;
    }
  }
  if (hit.status == STATUS_HIT) refine(ray, bracket, hit);
  return hit;
}
