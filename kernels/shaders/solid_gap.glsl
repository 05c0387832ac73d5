#ifndef SOLID_GAP_GLSL
#define SOLID_GAP_GLSL
// What stands for gap.glsl in a solid between two bilinear surfaces: where the upper one is over the lower one, what is
// between them. Elsewhere there is nothing, and a ray may pass.

// Heights of both surfaces, the upper one first.
vec2 sample_solid(vec2 uv, int level, inout int taps) {
  vec2 heights = sample_map(relief_map, uv, level, taps).xy;
  if (LAYOUT == LAYOUT_SPLIT) heights.y = sample_map(extra_map, uv, level, taps).x;
  return heights;
}

// How far the ray is outside the solid at t, over it or under it. Where that has no thickness, a ray that is just
// between both surfaces is outside, too.
float gap_at(Ray ray, float t, inout Hit hit) {
  vec2 heights = sample_solid(ray.uv + ray.slope * t, ray.level, hit.taps);
  float gap = max((1.0 - t) - heights.x, heights.y - (1.0 - t));
  return heights.x > heights.y ? gap : max(gap, ARRIVED);
}
#endif
