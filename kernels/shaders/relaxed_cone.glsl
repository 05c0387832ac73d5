// Relaxed cone stepping [PO07]: the cones let a ray pierce the relief once, then the bracket is refined. The bracket
// is the last step (J to K in figure 18-10), where listing 18-3 takes half the ray (H to K) to save a register.
#include "cone_search.glsl"

layout(constant_id = 16) const int CONE_STEPS = 15;
layout(constant_id = 17) const int STEP = STEP_PLAIN;
layout(constant_id = 18) const int REFINEMENT = REFINE_BINARY;
layout(constant_id = 19) const int BINARY_STEPS = 6;
layout(constant_id = 20) const int SECANT_STEPS = 1;

Hit trace(Ray ray) {
  int refinement_steps = REFINEMENT == REFINE_BINARY ? BINARY_STEPS : SECANT_STEPS;
  return cone_search(ray, ConeSearch(CONE_STEPS, STEP, SHAPE_CONE, REFINEMENT, refinement_steps));
}
