#include "common.glsl"

// A frame of the benchmark: its camera, and the rays of its pixels.
#include "frame_block.glsl"

ivec2 map_size() { return frame.sizes.zw; }

// Where a ray meets the polygon, which may lie under the relief's top.
float polygon_t() { return frame.surface.z == 0.0 ? 0.0 : frame.surface.z * frame.right.w / frame.position.w; }

// The ray of this pixel; false for the sky and, with clamp, beyond the edge of the polygon, the unit square. `precise`:
// every technique's frame has the same rays to the bit, so that one reference serves them all.
bool make_ray(vec2 pixel, out Ray ray) {
  precise vec3 direction = eye_direction(pixel);
  if (direction.z >= 0.0) return false;
  precise vec2 per_height = direction.xy / -direction.z;
  precise vec2 polygon = frame.position.xy + per_height * (frame.position.z + frame.surface.z);
  if (WRAP == WRAP_CLAMP && (any(lessThan(polygon, vec2(0.0))) || any(greaterThan(polygon, vec2(1.0))))) return false;
  precise vec2 plane = frame.position.xy + per_height * frame.position.z;
  precise vec2 uv = plane * frame.right.w;
  // With repeat, whole tiles are dropped here, where it is exact: small uv keep their precision far away.
  ray.uv = WRAP == WRAP_REPEAT ? uv - floor(uv) : uv;
  precise vec2 slope = per_height * frame.position.w;
  ray.slope = slope;
  ray.cosine = -direction.z * inversesqrt(dot(direction, direction));
  ray.level = 0;
  ray.relief = 1.0;
  return true;
}

#define light_here() frame.light.xyz
#define eye_depth_here() eye_depth(PIXEL)

// The image of a pixel that has a ray on the polygon, from the exact derivatives of its point there: its longer side is
// GL's scale factor of an isotropic sampler. Where the direction moves by s, the point moves by
// t * (s.xy + per_height * s.z).
Pixel pixel_at(vec2 pixel) {
  vec3 direction = eye_direction(pixel);
  vec2 per_height = direction.xy / -direction.z;
  float t = (frame.position.z + frame.surface.z) / -direction.z;
  vec2 texels = 2.0 * t * frame.right.w * vec2(map_size());
  float across = length((frame.right.xy + per_height * frame.right.z) * texels) / float(frame.sizes.x);
  float down = length((frame.up.xy + per_height * frame.up.z) * texels) / float(frame.sizes.y);
  return Pixel(vec2(min(across, down), max(across, down)), t * length(direction) * frame.right.w);
}
