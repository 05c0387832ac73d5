// Cone stepping with the conservative cone of the ray's own sector of directions: wider than one for all of them.
#include "cone_search.glsl"
#include "refinement.glsl"

Hit trace(Ray ray) {
  Bracket bracket;
  Hit hit;
  ConeSearch search = ConeSearch(CONE_STEPS, SHAPE_CONE, STEP != STEP_PLAIN, STEP == STEP_CELL_QUAD, 1.0);
  if (cone_search(ray, search, bracket, hit)) refine(ray, bracket, hit);
  return hit;
}
