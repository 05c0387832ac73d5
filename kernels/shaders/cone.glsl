// Cone step mapping on a conservative cone map [DUM06], with the cell steps of [BVBV24] made exact (cell_quad).
#include "cone_search.glsl"

layout(constant_id = 16) const int CONE_STEPS = 32;
layout(constant_id = 17) const int STEP = STEP_CELL_QUAD;
layout(constant_id = 18) const int REFINEMENT = REFINE_NONE;
layout(constant_id = 19) const int BINARY_STEPS = 6;
layout(constant_id = 20) const int SECANT_STEPS = 1;

Hit trace(Ray ray) {
  return cone_search(ray, CONE_STEPS, STEP, REFINEMENT, REFINEMENT == REFINE_BINARY ? BINARY_STEPS : SECANT_STEPS);
}
