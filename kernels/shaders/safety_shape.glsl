// Safety shapes [BES12]: a relaxed cone and a cylinder over each texel; in either, a ray pierces the relief at most
// once, and the bracket is refined as with relaxed cones.
#include "cone_search.glsl"

layout(constant_id = 16) const int CONE_STEPS = 15;
layout(constant_id = 17) const int STEP = STEP_PLAIN;
layout(constant_id = 18) const int REFINEMENT = REFINE_BINARY;
layout(constant_id = 19) const int BINARY_STEPS = 6;
layout(constant_id = 20) const int SECANT_STEPS = 1;

Hit trace(Ray ray) {
  int refinement_steps = REFINEMENT == REFINE_BINARY ? BINARY_STEPS : SECANT_STEPS;
  return cone_search(ray, ConeSearch(CONE_STEPS, STEP, SHAPE_SAFETY, REFINEMENT, refinement_steps));
}
