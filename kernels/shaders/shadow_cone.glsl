// Upwards through a map of conservative cones: a ray that is steeper than the cone under it is lit, another is free as
// far as the cone reaches, and to the border of its cell at least, with the cell's surface solved. Free cones: [DUM06];
// the way up and the solved cells: ours.
#include "cone_sample.glsl"
#include "shadow_bias.glsl"
#include "shadow_block.glsl"

// A ray that its steps leave undecided is in shadow, so that none is lit that should not be.
float relief_shadow(Ray ray, Scene scene, inout Hit hit) {
  if (is_under_horizon(scene, hit)) return 0.0;
  LightRay light = light_ray(ray, hit, scene, shadow_bias());
  float ray_ratio = length(light.path.slope);
  if (ray_ratio == 0.0) return 1.0;  // straight up
  float shift = 0.0;
  if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE) shift = sampler_shift(light.path.level);
  Path path = texel_path(light.path);
  float s = 0.0;
  for (int i = 0; i < SHADOW_STEPS; ++i) {
    hit.steps += 1;
    Relief relief = sample_relief(light.path, s, SHAPE_CONE, 0, hit.taps);
    float gap = light.z + s - relief.height;
    if (i == 0 && gap < 0.0) {  // a hit under the surface is lifted onto it
      light.z = min(light.z - gap, 1.0);
      light.top = 1.0 - light.z;
      gap = 0.0;
    }
    if (gap < -ARRIVED) return 0.0;
    float sure = max(gap, 0.0);
    if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE) sure = sure_gap(relief.ratio, gap, shift);
    float next = s;
    if (relief.ratio < ray_ratio) {
      next += relief.ratio * sure / (ray_ratio - relief.ratio);
    } else if (SAMPLER_SHIFT == SAMPLER_SHIFT_NONE || sure > 0.0) {
      return 1.0;
    }
    Cell cell = cell_ahead(path, s);
    if (next < cell.t_border) {
      next = min(cell.t_border, light.top);
      if (cell_blocks(light, cell, s, next, hit)) return 0.0;
    }
    if (next >= light.top) return 1.0;
    s = next;
  }
  return 0.0;
}
