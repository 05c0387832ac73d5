// Relief mapping: equal linear steps until the ray is under the relief, then refinement. [RTM] listing 5.3
#include "refine.glsl"

layout(constant_id = 16) const int LINEAR_STEPS = 16;
layout(constant_id = 17) const int REFINEMENT = REFINE_BINARY;
layout(constant_id = 18) const int BINARY_STEPS = 5;
layout(constant_id = 19) const int SECANT_STEPS = 1;

Hit trace(Ray ray) {
  Hit hit = Hit(0.0, STATUS_HIT, 0, 0);
  float gap = gap_at(ray, 0.0, hit);
  if (gap <= 0.0) return hit;

  // The bottom plate is under every relief (1 - t is exactly 0 at the last step), so that a bracket is always found.
  Bracket bracket = Bracket(0.0, 1.0, gap, 0.0);
  bool found = false;
  for (int i = 1; i <= LINEAR_STEPS; ++i) {
    float t = float(i) / float(LINEAR_STEPS);
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
  refine(ray, bracket, REFINEMENT, REFINEMENT == REFINE_BINARY ? BINARY_STEPS : SECANT_STEPS, hit);
  return hit;
}
