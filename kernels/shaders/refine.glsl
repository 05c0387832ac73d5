#ifndef REFINE_GLSL
#define REFINE_GLSL
// Narrowing a bracket round a hit.

// The ray is above the surface at lo by gap_lo > 0, and at or under it at hi by gap_hi <= 0.
struct Bracket {
  float lo;
  float hi;
  float gap_lo;
  float gap_hi;
};

// How far the ray is above the surface at t.
float gap_at(Ray ray, float t, inout Hit hit) {
  return RAY_HEIGHT(ray, t) - sample_map(relief_map, ray.uv + ray.slope * t, ray.level, hit.taps).x;
}

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
#endif
