#ifndef LINEAR_SEARCH_GLSL
#define LINEAR_SEARCH_GLSL
// Equal steps down the ray until it is under the relief. [RTM] listing 5.3
#include "refine.glsl"

// steps: 1 or more; of a part of a step the last one is that much shorter
// first: length of the first one, in steps; over 0, at most 1
// bracket: round the hit
// returns: whether there is anything to refine; otherwise the ray starts under the relief, and hit is final
bool linear_search(Ray ray, float steps, float first, out Bracket bracket, out Hit hit) {
  hit = Hit(0.0, STATUS_HIT, 0, 0);
  float gap = gap_at(ray, 0.0, hit);
  // The bottom plate is under every relief (the ray is exactly on it at the last step), so that a bracket is always
  // found.
  bracket = Bracket(0.0, RAY_END(ray), gap, 0.0);
  if (gap <= 0.0) return false;

  bool found = false;
  for (int i = 0; i <= int(ceil(steps - first)); ++i) {
    float t = min((float(i) + first) / steps, 1.0);
    IF_BENT(t *= ray.end;)
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
  IF_BENT(if (!found && leaves(ray)) hit.t = ray.end;)
  IF_BENT(if (!found && leaves(ray)) return false;)
  return true;
}
#endif
