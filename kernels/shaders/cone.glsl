// Cone step mapping on a conservative cone map [DUM06], with the cell steps of [BVBV24] made exact (cell_quad).
#include "stride.glsl"
#include "refinement.glsl"

// The level whose texels are at most as large as the pixel, constant along the ray. 2^16 texels a side end any chain.
int footprint_level(Ray ray) {
  int level = int(floor(log2(clamp(ray.footprint, 1.0, 65536.0))));
  return clamp(level, 0, textureQueryLevels(relief_map) - 1);
}

Hit trace(Ray ray) {
  if (LOD == LOD_FOOTPRINT) ray.level = footprint_level(ray);
  Bracket bracket;
  Hit hit;
  ConeSearch search = ConeSearch(CONE_STEPS, SHAPE_CONE, STEP != STEP_PLAIN, STEP == STEP_CELL_QUAD, chosen_stride());
  if (cone_search(ray, search, bracket, hit)) refine(ray, bracket, hit);
  return hit;
}
