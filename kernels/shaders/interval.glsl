// Interval mapping [RIS05]: a search, then intersections of the ray with the chord between the surface's heights at the
// bracket's ends. That is secant refinement (regula falsi) counted in chords: the last chord is not probed.
#include "cone_search.glsl"
#include "dither.glsl"
#include "linear_search.glsl"

Hit trace(Ray ray) {
  Bracket bracket;
  Hit hit;
  bool found = false;
  if (SEARCH == SEARCH_LINEAR) found = linear_search(ray, float(LINEAR_STEPS), first_step(), bracket, hit);
  if (SEARCH == SEARCH_CONE)
    found = cone_search(ray, ConeSearch(CONE_STEPS, SHAPE_CONE, false, false, 1.0), bracket, hit);
  if (found && INTERVAL_STEPS == 0) hit.t = bracket.hi;
  if (found && INTERVAL_STEPS > 0) refine_secant(ray, bracket, INTERVAL_STEPS - 1, hit);
  return hit;
}
