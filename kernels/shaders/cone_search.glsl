#ifndef CONE_SEARCH_GLSL
#define CONE_SEARCH_GLSL
// Stepping through a map of cones, conservative or relaxed.
#include "cell.glsl"
#include "cone_sample.glsl"
#include "refine.glsl"

struct ConeSearch {
  int max_steps;
  int shape;            // SHAPE_*
  bool leaves_cell;     // every step reaches the border of the ray's cell at least [BVBV24]
  bool solves_surface;  // of the cells that the cone does not lead out of; false: they are left untested
};

// Whether the ray has come to the surface. An exact solution needs no tolerance, which could stop a grazing ray short
// of a touch, and it alone tells where the sampler may read beside the ray.
bool has_arrived(ConeSearch search, float t, float gap) {
  if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE && search.solves_surface) return t == 1.0;
  return gap <= (search.solves_surface ? 0.0 : ARRIVED);
}

// Where the next look is taken. A cell that holds the hit ends the search.
float next_t(Ray ray, ConeSearch search, Relief relief, float gap, float ray_ratio, inout Hit hit) {
  float t_next = hit.t + free_step(relief, gap, ray_ratio, search.shape);
  if (search.leaves_cell) {
    Cell cell = cell_ahead(ray, hit.t);
    if (t_next < cell.t_border) {
      t_next = cell.t_border;
      if (search.solves_surface) {
        float t_hit = cell_hit(ray, cell, hit.t, min(cell.t_border, 1.0), hit);
        if (t_hit < INFINITE_T) {
          t_next = t_hit;
          hit.status = STATUS_HIT;
        }
      }
    }
  }
  return min(t_next, 1.0);
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
  bracket = Bracket(0.0, 0.0, 0.0, 0.0);
  bool pierced = false;
  // One look more than there are steps: a hit exactly at the cap is a hit.
  for (int i = 0; i <= search.max_steps; ++i) {
    Relief relief = sample_relief(ray, hit.t, search.shape, channel, hit.taps);
    float gap = (1.0 - hit.t) - relief.height;
    float sure = gap;
    if (SAMPLER_SHIFT != SAMPLER_SHIFT_NONE) sure = sure_gap(relief, gap, shift);
    if (hit.status == STATUS_STEP_CAP) {
      if (has_arrived(search, hit.t, sure)) {
        hit.status = STATUS_HIT;
        pierced = gap <= 0.0 && hit.t > bracket.lo;
        bracket.hi = hit.t;
        bracket.gap_hi = gap;
      } else if (i < search.max_steps) {
        hit.steps += 1;
        bracket.lo = hit.t;
        bracket.gap_lo = gap;
        hit.t = next_t(ray, search, relief, sure, ray_ratio, hit);
      }
    }
    if (LOOP == LOOP_EARLY_EXIT && hit.status == STATUS_HIT) break;
  }
  return pierced;
}
#endif
