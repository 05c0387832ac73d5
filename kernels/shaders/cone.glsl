// Cone step mapping on a conservative cone map [DUM06], with the cell steps of [BVBV24] made exact (cell_quad).
#include "stride.glsl"
#include "refinement.glsl"

Hit trace(Ray ray) {
  Bracket bracket;
  Hit hit;
  ConeSearch search = ConeSearch(CONE_STEPS, SHAPE_CONE, STEP != STEP_PLAIN, STEP == STEP_CELL_QUAD, chosen_stride());
  if (cone_search(ray, search, bracket, hit)) refine(ray, bracket, hit);
  return hit;
}
