// Stepping through a cone map, conservative or relaxed.
#include "cell.glsl"
#include "refine.glsl"

const int STEP_PLAIN = 0;      // the cone alone
const int STEP_CELL_MAX = 1;   // at least to the border of the cell, its rest untested [BVBV24]
const int STEP_CELL_QUAD = 2;  // within the cell the bilinear surface is solved, then on to the border

// How far the cone at height `gap` below the ray lets it go. A ray straight down meets its own texel, cone or not.
float cone_step(float ratio, float gap, float ray_ratio) {
  return ray_ratio == 0.0 ? gap : ratio * gap / (ray_ratio + ratio);
}

// Walks until the ray has arrived at the surface, is under it (then it is refined), or max_steps are used up.
Hit cone_search(Ray ray, int max_steps, int step_rule, int refinement, int refinement_steps) {
  Hit hit = Hit(0.0, STATUS_STEP_CAP, 0, 0);
  float ray_ratio = length(ray.slope);
  Bracket bracket = Bracket(0.0, 0.0, 0.0, 0.0);
  bool pierced = false;
  // One look more than there are steps: a hit exactly at the cap is a hit.
  for (int i = 0; i <= max_steps; ++i) {
    vec2 relief = sample_relief(ray.uv + ray.slope * hit.t, hit.taps);
    float gap = (1.0 - hit.t) - relief.x;
    if (hit.status == STATUS_STEP_CAP) {
      // An exact solution needs no tolerance, which could stop a grazing ray short of a touch.
      if (gap <= (step_rule == STEP_CELL_QUAD ? 0.0 : ARRIVED)) {
        hit.status = STATUS_HIT;
        pierced = gap <= 0.0 && hit.t > bracket.lo;
        bracket.hi = hit.t;
        bracket.gap_hi = gap;
      } else if (i < max_steps) {
        hit.steps += 1;
        bracket.lo = hit.t;
        bracket.gap_lo = gap;
        float t_next = hit.t + cone_step(relief.y, gap, ray_ratio);
        if (step_rule != STEP_PLAIN) {
          Cell cell = cell_ahead(ray, hit.t);
          if (t_next < cell.t_border) {
            t_next = cell.t_border;
            if (step_rule == STEP_CELL_QUAD) {
              float t_hit = cell_hit(ray, cell, hit.t, min(cell.t_border, 1.0), hit);
              if (t_hit < INFINITE_T) {
                t_next = t_hit;
                hit.status = STATUS_HIT;
              }
            }
          }
        }
        hit.t = min(t_next, 1.0);
      }
    }
    if (LOOP == LOOP_EARLY_EXIT && hit.status == STATUS_HIT) break;
  }
  if (pierced) refine(ray, bracket, refinement, refinement_steps, hit);
  return hit;
}
