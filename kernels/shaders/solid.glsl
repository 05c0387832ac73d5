#ifndef SOLID_GLSL
#define SOLID_GLSL
// A solid between two bilinear surfaces: where the upper one is over the lower one, what is between them. Elsewhere
// there is nothing, and a ray may pass.
#include "refinement.glsl"

// Heights of both surfaces, the upper one first.
vec2 sample_solid(vec2 uv, int level, inout int taps) {
  vec2 heights = sample_map(relief_map, uv, level, taps).xy;
  if (LAYOUT == LAYOUT_SPLIT) heights.y = sample_map(extra_map, uv, level, taps).x;
  return heights;
}

// How far the ray is outside the solid at t, over it or under it. Where that has no thickness, a ray that is just
// between both surfaces is outside, too.
float solid_gap(Ray ray, float t, inout Hit hit) {
  vec2 heights = sample_solid(ray.uv + ray.slope * t, ray.level, hit.taps);
  float gap = max((1.0 - t) - heights.x, heights.y - (1.0 - t));
  return heights.x > heights.y ? gap : max(gap, ARRIVED);
}

// Whether the ray is outside the solid at t, which is then that end of the bracket.
bool is_outside(Ray ray, float t, inout Bracket b, inout Hit hit) {
  float gap = solid_gap(ray, t, hit);
  if (gap > 0.0) {
    b.lo = t;
    b.gap_lo = gap;
  } else {
    b.hi = t;
    b.gap_hi = gap;
  }
  return gap > 0.0;
}

// As refine(), in solids.
void refine_solid(Ray ray, Bracket b, inout Hit hit) {
  if (REFINEMENT == REFINEMENT_NONE) hit.t = b.hi;
  if (REFINEMENT == REFINEMENT_SECANT) {
    for (int i = 0; i < SECANT_STEPS; ++i) is_outside(ray, interpolated(b), b, hit);
    hit.steps += SECANT_STEPS;
    hit.t = interpolated(b);
  }
  if (REFINEMENT == REFINEMENT_BINARY) {
    for (int i = 0; i < BINARY_STEPS; ++i) is_outside(ray, 0.5 * (b.lo + b.hi), b, hit);
    hit.steps += BINARY_STEPS;
    hit.t = 0.5 * (b.lo + b.hi);
  }
  if (REFINEMENT == REFINEMENT_CONTACT) {
    float near = b.lo;
    float apart = (b.hi - b.lo) / float(CONTACT_STEPS);
    hit.t = b.hi;
    for (int i = 1; i < CONTACT_STEPS; ++i) {
      float t = near + apart * float(i);
      hit.steps += 1;
      if (is_outside(ray, t, b, hit)) continue;
      hit.t = t;
      break;
    }
  }
}
#endif
