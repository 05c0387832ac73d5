// Relaxed cone stepping [PO07]: the cones let a ray pierce the relief once, then the bracket is refined. The bracket
// is the last step (J to K in figure 18-10), where listing 18-3 takes half the ray (H to K) to save a register.
#include "cone_search.glsl"

const int CHOICE_SECANT = 0;
const int CHOICE_BINARY = 1;

layout(constant_id = 16) const int CONE_STEPS = 15;
layout(constant_id = 17) const int REFINEMENT = CHOICE_BINARY;
layout(constant_id = 18) const int BINARY_STEPS = 6;
layout(constant_id = 19) const int SECANT_STEPS = 1;

Hit trace(Ray ray) {
  bool binary = REFINEMENT == CHOICE_BINARY;
  return cone_search(ray, CONE_STEPS, STEP_PLAIN, binary ? REFINE_BINARY : REFINE_SECANT,
                     binary ? BINARY_STEPS : SECANT_STEPS);
}
