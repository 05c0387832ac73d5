// Cone step mapping on a conservative cone map [DUM06], with the cell steps of [BVBV24] made exact (cell_quad).
#include "cone_search.glsl"

const int LOD_BASE = 0;
const int LOD_FOOTPRINT = 1;

layout(constant_id = 16) const int CONE_STEPS = 32;
layout(constant_id = 17) const int STEP = STEP_CELL_QUAD;
layout(constant_id = 18) const int REFINEMENT = REFINE_NONE;
layout(constant_id = 19) const int BINARY_STEPS = 6;
layout(constant_id = 20) const int SECANT_STEPS = 1;
layout(constant_id = 21) const int LOD = LOD_BASE;

// The level whose texels are at most as large as the pixel, constant along the ray. 2^16 texels a side end any chain.
int footprint_level(Ray ray) {
  int level = int(floor(log2(clamp(ray.footprint, 1.0, 65536.0))));
  return clamp(level, 0, textureQueryLevels(relief_map) - 1);
}

Hit trace(Ray ray) {
  if (LOD == LOD_FOOTPRINT) ray.level = footprint_level(ray);
  int refinement_steps = REFINEMENT == REFINE_BINARY ? BINARY_STEPS : SECANT_STEPS;
  return cone_search(ray, ConeSearch(CONE_STEPS, STEP, SHAPE_CONE, REFINEMENT, refinement_steps));
}
