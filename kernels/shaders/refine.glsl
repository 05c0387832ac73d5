#ifndef REFINE_GLSL
#define REFINE_GLSL
// Narrowing a bracket round a hit.
const int REFINE_NONE = 0;
const int REFINE_SECANT = 1;
const int REFINE_BINARY = 2;

// The ray is above the surface at lo by gap_lo > 0, and at or under it at hi by gap_hi <= 0.
struct Bracket {
  float lo;
  float hi;
  float gap_lo;
  float gap_hi;
};

// How far the ray is above the surface at t.
float gap_at(Ray ray, float t, inout Hit hit) {
  return (1.0 - t) - sample_map(relief_map, ray.uv + ray.slope * t, ray.level, hit.taps).x;
}

// Where a line through the bracket's ends meets zero; gap_lo > 0 >= gap_hi, so that it never divides by zero.
float interpolated(Bracket b) { return b.lo + (b.hi - b.lo) * (b.gap_lo / (b.gap_lo - b.gap_hi)); }

void refine(Ray ray, Bracket b, int refinement, int steps, inout Hit hit) {
  if (refinement == REFINE_NONE) {
    hit.t = b.hi;
    return;
  }
  for (int i = 0; i < steps; ++i) {
    float t = refinement == REFINE_BINARY ? 0.5 * (b.lo + b.hi) : interpolated(b);
    float gap = gap_at(ray, t, hit);
    if (gap > 0.0) {
      b.lo = t;
      b.gap_lo = gap;
    } else {
      b.hi = t;
      b.gap_hi = gap;
    }
  }
  hit.steps += steps;
  hit.t = refinement == REFINE_BINARY ? 0.5 * (b.lo + b.hi) : interpolated(b);
}
#endif
