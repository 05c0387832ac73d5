#ifndef STRIDE_GLSL
#define STRIDE_GLSL
// By how much of a free step a ray goes on at once, as the parameter over_relaxation says.
#include "cone_search.glsl"

float chosen_stride() {
  if (OVER_RELAXATION == OVER_RELAXATION_1_3) return 1.3;
  return OVER_RELAXATION == OVER_RELAXATION_AUTO ? ADAPTED_STRIDE : 1.0;
}
#endif
