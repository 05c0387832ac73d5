// Cone stepping with one conservative cone for each quarter of the directions: wider than one for all of them.
#include "stride.glsl"
#include "refinement.glsl"

Hit trace(Ray ray) {
  Bracket bracket;
  Hit hit;
  ConeSearch search = ConeSearch(CONE_STEPS, SHAPE_QUAD, STEP != STEP_PLAIN, STEP == STEP_CELL_QUAD, chosen_stride());
  if (cone_search(ray, search, bracket, hit)) refine(ray, bracket, hit);
  return hit;
}
