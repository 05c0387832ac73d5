// Upwards through a map of conservative cones: a ray that is steeper than the cone under it is lit, another is free as
// far as the cone reaches, and to the border of its cell at least, with the cell's surface solved. Free cones: [DUM06];
// the way up and the solved cells: ours.
#include "cell.glsl"
#include "cone_sample.glsl"
#include "shadow.glsl"
#include "shadow_bias.glsl"

// Whether the cell's surface stands over the ray anywhere from s to s_end. f(s) = f0 + b s + a s^2 is the gap; the ray
// comes in on or above the surface, so that a negative f0 is rounding.
bool cell_blocks(LightRay light, Cell cell, float s, float s_end, inout Hit hit) {
  vec4 h = cell_heights(cell.index, 0, hit.taps);
  vec2 size = vec2(level_size(0));
  vec2 d = light.path.slope * size;
  vec2 f = light.path.uv * size - 0.5 + d * s - cell.index;
  float along_x = h.z - h.w;
  float along_y = h.x - h.w;
  float twist = h.w - h.z - h.x + h.y;
  float f0 = max((light.z + s) - (h.w + along_x * f.x + (along_y + twist * f.x) * f.y), 0.0);
  float a = -twist * d.x * d.y;
  float b = 1.0 - ((along_x + twist * f.y) * d.x + (along_y + twist * f.x) * d.y);
  float rise = s_end - s;
  if (f0 + (b + a * rise) * rise < 0.0) return true;
  return a > 0.0 && b < 0.0 && -b < 2.0 * a * rise && b * b > 4.0 * a * f0;
}

// A ray that its steps leave undecided is in shadow, so that none is lit that should not be.
float relief_shadow(Ray ray, Scene scene, inout Hit hit) {
  if (is_under_horizon(scene, hit)) return 0.0;
  LightRay light = light_ray(ray, hit, scene, shadow_bias());
  float ray_ratio = length(light.path.slope);
  if (ray_ratio == 0.0) return 1.0;  // straight up
  float shift = 0.0;
  if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE) shift = sampler_shift(0);
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
    Cell cell = cell_ahead(light.path, s);
    if (next < cell.t_border) {
      next = min(cell.t_border, light.top);
      if (cell_blocks(light, cell, s, next, hit)) return 0.0;
    }
    if (next >= light.top) return 1.0;
    s = next;
  }
  return 0.0;
}
