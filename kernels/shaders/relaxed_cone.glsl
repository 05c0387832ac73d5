// Relaxed cone stepping [PO07]: the cones let a ray pierce the relief once, then the bracket is refined. The bracket
// is the last step (J to K in figure 18-10), where listing 18-3 takes half the ray (H to K) to save a register.
#include "cone_search.glsl"
#include "refinement.glsl"

Hit trace(Ray ray) {
  Bracket bracket;
  Hit hit;
  ConeSearch search = ConeSearch(CONE_STEPS, SHAPE_CONE, STEP != STEP_PLAIN, STEP == STEP_CELL_QUAD, 1.0);
  if (cone_search(ray, search, bracket, hit)) refine(ray, bracket, hit);
  return hit;
}
