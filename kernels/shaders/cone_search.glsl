#ifndef CONE_SEARCH_GLSL
#define CONE_SEARCH_GLSL
// Stepping through a map of cones, conservative or relaxed.
#include "cell.glsl"
#include "cone_sample.glsl"
#include "refine.glsl"

const float ADAPTED_STRIDE = 0.0;

struct ConeSearch {
  int max_steps;
  int shape;            // SHAPE_*
  bool leaves_cell;     // every step reaches the border of the ray's cell at least [BVBV24]
  bool solves_surface;  // of the cells that the cone does not lead out of; false: they are left untested
  float stride;         // of a free step that is gone at once: 1, or more, or ADAPTED_STRIDE
};

// Whether the ray has come to the surface. An exact solution needs no tolerance, which could stop a grazing ray short
// of a touch, and it alone tells where the sampler may read beside the ray.
bool has_arrived(ConeSearch search, float t, float gap) {
  if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE && search.solves_surface) return t == 1.0;
  return gap <= (search.solves_surface ? 0.0 : ARRIVED);
}

// How far (in t) the ray is free behind the point `gap` above the surface: it is in that point's cone, too.
float free_behind(Relief relief, float gap, float ray_ratio, float shift) {
  float sure = gap;
  if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE) sure = sure_gap(relief.behind, gap, shift);
  if (sure <= 0.0) return 0.0;
  return ray_ratio > relief.behind ? relief.behind * sure / (ray_ratio - relief.behind) : INFINITE_T;
}

// By how much of a free step the ray goes on when the free steps' slope along it is this. If it stays, the way back
// from the next point just meets the way there.
float adapted_stride(float slope) { return clamp(2.0 / (1.0 - slope), 1.0, 2.0); }

// Where the next look is taken. A cell that holds the hit ends the search.
float next_t(Ray ray, Path path, ConeSearch search, Relief relief, float gap, float ray_ratio, inout Hit hit) {
  float t_next = hit.t + free_step(relief, gap, ray_ratio, search.shape);
  if (search.leaves_cell) {
    Cell cell = cell_ahead(path, hit.t);
    if (t_next < cell.t_border) {
      t_next = cell.t_border;
      if (search.solves_surface) {
        float t_hit = cell_hit(ray, cell, hit.t, min(cell.t_border, RAY_END(ray)), hit);
        if (t_hit < INFINITE_T) {
          t_next = t_hit;
          hit.status = STATUS_HIT;
        }
      }
    }
  }
  return min(t_next, RAY_END(ray));
}

// Walks until the ray has arrived at the surface, is under it, or max_steps are used up.
// bracket: of the last step
// returns: whether the ray is under the surface, so that there is something to refine
bool cone_search(Ray ray, ConeSearch search, out Bracket bracket, out Hit hit) {
  hit = Hit(0.0, STATUS_STEP_CAP, 0, 0);
  float ray_ratio = length(ray.slope);
  int channel = ratio_channel(search.shape, ray.slope);
  float shift = 0.0;
  if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE) shift = sampler_shift(ray.level);
  Path path = texel_path(ray);
  bracket = Bracket(0.0, 0.0, 0.0, 0.0);
  bool pierced = false;
  float reach = 0.0;   // the ray is free up to here
  float slope = -1.0;  // of the free steps along the ray, averaged
  float last_t = 0.0;
  float last_free = 0.0;
  // One look more than there are steps: a hit exactly at the cap is a hit.
  for (int i = 0; i <= search.max_steps; ++i) {
    IF_BENT(if (hit.t >= ray.end && leaves(ray)) break;)
    Relief relief = sample_relief(ray, hit.t, search.shape, channel, hit.taps);
    float gap = RAY_HEIGHT(ray, hit.t) - relief.height;
    float sure = gap;
    if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE) sure = sure_gap(relief.ratio, gap, shift);
    if (hit.status == STATUS_STEP_CAP) {
      bool is_reached = search.stride == 1.0 || hit.t == reach;
      if (!is_reached && hit.t - free_behind(relief, gap, ray_ratio, shift) > reach) {
        hit.steps += i < search.max_steps ? 1 : 0;
        hit.t = reach;
        slope = -1.0;
      } else if (has_arrived(search, RAY_SHARE(ray, hit.t), sure)) {
        hit.status = STATUS_HIT;
        pierced = gap < 0.0 && hit.t > bracket.lo;  // what is on the surface is found
        bracket.hi = hit.t;
        bracket.gap_hi = gap;
      } else if (i < search.max_steps) {
        hit.steps += 1;
        bracket.lo = hit.t;
        bracket.gap_lo = gap;
        float t = hit.t;
        hit.t = next_t(ray, path, search, relief, sure, ray_ratio, hit);
        reach = hit.t;
        if (search.stride != 1.0 && hit.status == STATUS_STEP_CAP) {
          float free = free_step(relief, sure, ray_ratio, search.shape);
          if (t > last_t) slope = mix(slope, (free - last_free) / (t - last_t), 0.5);
          last_t = t;
          last_free = free;
          float stride = search.stride == ADAPTED_STRIDE ? adapted_stride(slope) : search.stride;
          hit.t = min(max(hit.t, t + free * stride), RAY_END(ray));
        }
      }
    }
    if (LOOP == LOOP_EARLY_EXIT && hit.status == STATUS_HIT) break;
  }
  return pierced;
}
#endif
