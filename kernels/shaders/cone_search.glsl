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
// of a touch. A sampler that may read beside the ray cannot tell: the solution alone does, or that no step is safe.
// step_t: the free step from here
bool has_arrived(ConeSearch search, float t, float gap, float step_t) {
  if (FILTER_SHIFT != FILTER_SHIFT_NONE)
    return t == 1.0 || (!search.solves_surface && (gap <= ARRIVED || step_t == 0.0));
  return gap <= (search.solves_surface ? 0.0 : ARRIVED);
}

// Where the next look is taken. A cell that holds the hit ends the search.
float next_t(Ray ray, ConeSearch search, float step_t, inout Hit hit) {
  float t_next = hit.t + step_t;
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
  bracket = Bracket(0.0, 0.0, 0.0, 0.0);
  bool pierced = false;
  // One look more than there are steps: a hit exactly at the cap is a hit.
  for (int i = 0; i <= search.max_steps; ++i) {
    Relief relief = sample_relief(ray, hit.t, search.shape, channel, hit.taps);
    float gap = (1.0 - hit.t) - relief.height;
    float step_t = free_step(ray, relief, gap, ray_ratio, search.shape);
    if (hit.status == STATUS_STEP_CAP) {
      if (has_arrived(search, hit.t, gap, step_t)) {
        hit.status = STATUS_HIT;
        pierced = gap <= 0.0 && hit.t > bracket.lo;
        bracket.hi = hit.t;
        bracket.gap_hi = gap;
      } else if (i < search.max_steps) {
        hit.steps += 1;
        bracket.lo = hit.t;
        bracket.gap_lo = gap;
        hit.t = next_t(ray, search, step_t, hit);
      }
    }
    if (LOOP == LOOP_EARLY_EXIT && hit.status == STATUS_HIT) break;
  }
  return pierced;
}
#endif
