// Cone stepping in a solid: by the upward cone where the ray is over the upper surface, by the downward one where it is
// under the lower one, by the farther where it is both; at least to the cell's border, the cell solved. A ray that
// stays in a downward cone passes.
#define MAY_PASS
#include "cone_sample.glsl"
#include "solid_cell.glsl"

// Over the quotient that two nearly equal slopes would leave to rounding.
const float STEEPER = 1.00000095367431640625;  // 1 + 2^-20

// Both cones under the ray at t. The downward one is as if the map were turned over: its heights are 1 - floor.
void sample_cones(Ray ray, float t, out Relief up, out Relief down, inout int taps) {
  vec2 uv = ray.uv + ray.slope * t;
  float top = sample_map(relief_map, uv, ray.level, taps).x;
  vec4 beside = sample_map(extra_map, uv, ray.level, taps);
  up = decoded_relief(top, beside.y);
  down = decoded_relief(1.0 - beside.x, beside.z);
}

// How far (in t) a ray may go from `gap` under the lower surface: into the open, farther than any cone leads over it.
float free_below(Relief down, float gap, float ray_ratio) {
  if (ray_ratio * STEEPER <= down.ratio) return 1.0;
  return down.ratio * gap / (ray_ratio * STEEPER - down.ratio);
}

Hit trace(Ray ray) {
  Hit hit = Hit(0.0, STATUS_STEP_CAP, 0, 0);
  float ray_ratio = length(ray.slope);
  float shift = 0.0;
  if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE) shift = sampler_shift(ray.level);
  Path path = texel_path(ray);
  while (hit.status == STATUS_STEP_CAP && hit.steps < CONE_STEPS) {
    hit.steps += 1;
    Relief up;
    Relief down;
    sample_cones(ray, hit.t, up, down, hit.taps);
    float over = (1.0 - hit.t) - up.height;
    float under = hit.t - down.height;
    if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE) {
      over = sure_gap(up.ratio, over, shift);
      under = sure_gap(down.ratio, under, shift);
    }
    float free = 0.0;
    if (over > 0.0) free = free_step(up, over, ray_ratio, SHAPE_CONE);
    if (under > 0.0) free = max(free, free_below(down, under, ray_ratio));
    float t_next = hit.t + free;
    Cell cell = cell_ahead(path, hit.t);
    if (t_next < cell.t_border) {
      float t_hit = solid_cell_hit(ray, cell, hit.t, min(cell.t_border, 1.0), hit);
      t_next = cell.t_border;
      if (t_hit < INFINITE_T) {
        t_next = t_hit;
        hit.status = STATUS_HIT;
      }
    }
    hit.t = min(t_next, 1.0);
    if (hit.status == STATUS_STEP_CAP && hit.t == 1.0) hit.status = STATUS_PASSED;
  }
  return hit;
}
