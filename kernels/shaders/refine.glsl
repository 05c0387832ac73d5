#ifndef REFINE_GLSL
#define REFINE_GLSL
// Narrowing a bracket round a hit.
#include "gap.glsl"

// The ray is above the surface at lo by gap_lo > 0, and at or under it at hi by gap_hi <= 0; outside of a solid, and in
// it.
struct Bracket {
  float lo;
  float hi;
  float gap_lo;
  float gap_hi;
};

// Where a line through the bracket's ends meets zero; gap_lo > 0 >= gap_hi, so that it never divides by zero.
float interpolated(Bracket b) { return b.lo + (b.hi - b.lo) * (b.gap_lo / (b.gap_lo - b.gap_hi)); }

// Whether the ray is above the surface at t, which is then that end of the bracket.
bool is_above(Ray ray, float t, inout Bracket b, inout Hit hit) {
  float gap = gap_at(ray, t, hit);
  if (gap > 0.0) {
    b.lo = t;
    b.gap_lo = gap;
  } else {
    b.hi = t;
    b.gap_hi = gap;
  }
  return gap > 0.0;
}

// probes: before the last interpolation, which is the hit
void refine_secant(Ray ray, Bracket b, int probes, inout Hit hit) {
  for (int i = 0; i < probes; ++i) is_above(ray, interpolated(b), b, hit);
  hit.steps += probes;
  hit.t = interpolated(b);
}

void refine_binary(Ray ray, Bracket b, int halvings, inout Hit hit) {
  for (int i = 0; i < halvings; ++i) is_above(ray, 0.5 * (b.lo + b.hi), b, hit);
  hit.steps += halvings;
  hit.t = 0.5 * (b.lo + b.hi);
}

// Equal steps again, inside the bracket: features are found that are thinner than the first steps. The first of them
// that is under the surface is the hit, at the latest the bracket's far end.
void refine_contact(Ray ray, Bracket b, int steps, inout Hit hit) {
  float near = b.lo;
  float apart = (b.hi - b.lo) / float(steps);
  hit.t = b.hi;
  for (int i = 1; i < steps; ++i) {
    float t = near + apart * float(i);
    hit.steps += 1;
    if (is_above(ray, t, b, hit)) continue;
    hit.t = t;
    break;
  }
}
#endif
