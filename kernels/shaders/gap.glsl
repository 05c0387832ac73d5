#ifndef GAP_GLSL
#define GAP_GLSL
// How far the ray is above the surface at t.
float gap_at(Ray ray, float t, inout Hit hit) {
  return RAY_HEIGHT(ray, t) - sample_map(relief_map, ray.uv + ray.slope * t, ray.level, hit.taps).x;
}
#endif
