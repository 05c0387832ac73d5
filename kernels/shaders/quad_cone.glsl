// Cone stepping with one conservative cone for each quarter of the directions: wider than one for all of them.
#include "cone_search.glsl"

layout(constant_id = 16) const int CONE_STEPS = 32;
layout(constant_id = 17) const int STEP = STEP_CELL_QUAD;
layout(constant_id = 18) const int REFINEMENT = REFINE_NONE;
layout(constant_id = 19) const int BINARY_STEPS = 6;
layout(constant_id = 20) const int SECANT_STEPS = 1;

Hit trace(Ray ray) {
  int refinement_steps = REFINEMENT == REFINE_BINARY ? BINARY_STEPS : SECANT_STEPS;
  return cone_search(ray, ConeSearch(CONE_STEPS, STEP, SHAPE_QUAD, REFINEMENT, refinement_steps));
}
