// Interval mapping [RIS05]: a search, then intersections of the ray with the chord between the surface's heights at the
// bracket's ends. That is secant refinement (regula falsi) counted in chords: the last chord is not probed.
#include "cone_search.glsl"
#include "linear_search.glsl"

const int SEARCH_LINEAR = 0;
const int SEARCH_CONE = 1;

layout(constant_id = 16) const int SEARCH = SEARCH_LINEAR;
layout(constant_id = 17) const int LINEAR_STEPS = 16;
layout(constant_id = 18) const int CONE_STEPS = 15;
layout(constant_id = 19) const int INTERVAL_STEPS = 2;

Hit trace(Ray ray) {
  int refinement = INTERVAL_STEPS > 0 ? REFINE_SECANT : REFINE_NONE;
  int probes = max(INTERVAL_STEPS - 1, 0);
  if (SEARCH == SEARCH_LINEAR) return linear_search(ray, LINEAR_STEPS, refinement, probes);
  return cone_search(ray, ConeSearch(CONE_STEPS, STEP_PLAIN, SHAPE_CONE, refinement, probes));
}
