// Relief mapping: linear search, then refinement. [RTM] listing 5.3
#include "linear_search.glsl"

layout(constant_id = 16) const int LINEAR_STEPS = 16;
layout(constant_id = 17) const int REFINEMENT = REFINE_BINARY;
layout(constant_id = 18) const int BINARY_STEPS = 5;
layout(constant_id = 19) const int SECANT_STEPS = 1;

Hit trace(Ray ray) {
  return linear_search(ray, LINEAR_STEPS, REFINEMENT, REFINEMENT == REFINE_BINARY ? BINARY_STEPS : SECANT_STEPS);
}
