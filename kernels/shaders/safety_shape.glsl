// Safety shapes [BES12]: a relaxed cone and a cylinder over each texel; in either, a ray pierces the relief at most
// once, and the bracket is refined as with relaxed cones.
#include "cone_search.glsl"
#include "refinement.glsl"

Hit trace(Ray ray) {
  Bracket bracket;
  Hit hit;
  ConeSearch search = ConeSearch(CONE_STEPS, SHAPE_SAFETY, STEP != STEP_PLAIN, STEP == STEP_CELL_QUAD, 1.0);
  if (cone_search(ray, search, bracket, hit)) refine(ray, bracket, hit);
  return hit;
}
