#ifndef LINEAR_SEARCH_GLSL
#define LINEAR_SEARCH_GLSL
// Equal steps down the ray until it is under the relief, then refinement.
#include "refine.glsl"

Hit linear_search(Ray ray, int steps, int refinement, int refinement_steps) {
  Hit hit = Hit(0.0, STATUS_HIT, 0, 0);
  float gap = gap_at(ray, 0.0, hit);
  if (gap <= 0.0) return hit;

  // The bottom plate is under every relief (1 - t is exactly 0 at the last step), so that a bracket is always found.
  Bracket bracket = Bracket(0.0, 1.0, gap, 0.0);
  bool found = false;
  for (int i = 1; i <= steps; ++i) {
    float t = float(i) / float(steps);
    gap = gap_at(ray, t, hit);
    hit.steps += 1;
    if (!found && gap <= 0.0) {
      bracket.hi = t;
      bracket.gap_hi = gap;
      found = true;
      if (LOOP == LOOP_EARLY_EXIT) break;
    }
    if (!found) {
      bracket.lo = t;
      bracket.gap_lo = gap;
    }
  }
  refine(ray, bracket, refinement, refinement_steps, hit);
  return hit;
}
#endif
