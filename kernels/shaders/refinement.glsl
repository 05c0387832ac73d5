// Refinement as the parameter of that name says, of techniques that have it.
#include "refine.glsl"

void refine(Ray ray, Bracket b, inout Hit hit) {
  if (REFINEMENT == REFINEMENT_NONE) hit.t = b.hi;
  if (REFINEMENT == REFINEMENT_SECANT) refine_secant(ray, b, SECANT_STEPS, hit);
  if (REFINEMENT == REFINEMENT_BINARY) refine_binary(ray, b, BINARY_STEPS, hit);
  if (REFINEMENT == REFINEMENT_CONTACT) refine_contact(ray, b, CONTACT_STEPS, hit);
}
