// Stepping through a cone map, conservative or relaxed.
#include "refine.glsl"

const int STEP_PLAIN = 0;      // the cone alone
const int STEP_CELL_MAX = 1;   // at least to the border of the cell, its rest untested [BVBV24]
const int STEP_CELL_QUAD = 2;  // within the cell the bilinear surface is solved, then on to the border

const float INFINITE_T = 1e30;

// The cell of the bilinear surface that the ray is about to cross at t, and the t at which it leaves it.
struct Cell {
  vec2 index;  // of its lower texel
  float t_border;
};

// One axis: x(t) = o + d t. On a border, the cell ahead is taken: t_border > t always, so that stepping makes progress
// with no epsilon. d = 0 never leaves (no 0/0).
float axis_border(float o, float d, float t, inout float index) {
  if (d == 0.0) return INFINITE_T;
  float border = d > 0.0 ? index + 1.0 : index;
  float t_border = (border - o) / d;
  if (t_border <= t) {
    index += sign(d);
    t_border = (border + sign(d) - o) / d;
  }
  return t_border;
}

Cell cell_ahead(Ray ray, float t) {
  vec2 size = vec2(frame.sizes.zw);
  vec2 o = ray.uv * size - 0.5;
  vec2 d = ray.slope * size;
  Cell cell;
  cell.index = floor(o + d * t);
  cell.t_border = min(axis_border(o.x, d.x, t, cell.index.x), axis_border(o.y, d.y, t, cell.index.y));
  return cell;
}

// First hit of the ray on the cell's bilinear surface within [t, t_end], or INFINITE_T.
// F(s) = f0 + b s + a s^2 is the gap along the ray; the root is taken in the form that does not cancel.
float cell_hit(Ray ray, Cell cell, float t, float t_end, inout Hit hit) {
  vec2 size = vec2(frame.sizes.zw);
  vec4 h = textureGather(relief_map, (cell.index + 1.0) / size, 0);  // 01, 11, 10, 00
  hit.taps += 1;
  vec2 d = ray.slope * size;
  vec2 f = ray.uv * size - 0.5 + d * t - cell.index;
  float along_x = h.z - h.w;
  float along_y = h.x - h.w;
  float twist = h.w - h.z - h.x + h.y;
  float f0 = (1.0 - t) - (h.w + along_x * f.x + (along_y + twist * f.x) * f.y);
  if (f0 <= 0.0) return t;
  float a = -twist * d.x * d.y;
  float b = -1.0 - ((along_x + twist * f.y) * d.x + (along_y + twist * f.x) * d.y);
  float length_t = t_end - t;
  float f1 = f0 + (b + a * length_t) * length_t;
  float discriminant = b * b - 4.0 * a * f0;
  bool dips = a > 0.0 && b < 0.0 && -b < 2.0 * a * length_t && discriminant >= 0.0;
  if (f1 > 0.0 && !dips) return INFINITE_T;
  float root = sqrt(max(discriminant, 0.0));
  float s = b <= 0.0 ? 2.0 * f0 / (root - b) : (b + root) / (-2.0 * a);
  return t + clamp(s, 0.0, length_t);
}

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
