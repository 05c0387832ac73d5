#include "common.glsl"

// A frame of the benchmark: its camera, and the rays of its pixels.
#include "frame_block.glsl"

ivec2 map_size() { return frame.sizes.zw; }

// Longer side of the pixel's image on the plane, in texels: GL's scale factor of an isotropic sampler, from the exact
// derivative of the plane's point. Where the direction moves by s, that moves by
// distance * (s.xy + per_height * s.z).
float pixel_footprint(vec2 per_height, float distance) {
  vec2 texels = 2.0 * distance * frame.right.w * vec2(map_size());
  vec2 across = (frame.right.xy + per_height * frame.right.z) * texels / float(frame.sizes.x);
  vec2 down = (frame.up.xy + per_height * frame.up.z) * texels / float(frame.sizes.y);
  return max(length(across), length(down));
}

// The ray of this pixel; false for the sky and, with clamp, beyond the edge of the unit square. `precise`: every
// technique's frame has the same rays to the bit, so that one reference serves them all.
bool make_ray(vec2 pixel, out Ray ray) {
  precise vec2 ndc = pixel / vec2(frame.sizes.xy) * 2.0 - 1.0;
  precise vec3 direction = frame.forward.xyz + frame.right.xyz * ndc.x - frame.up.xyz * ndc.y;
  if (direction.z >= 0.0) return false;
  precise vec2 per_height = direction.xy / -direction.z;
  precise vec2 plane = frame.position.xy + per_height * frame.position.z;
  if (WRAP == WRAP_CLAMP && (any(lessThan(plane, vec2(0.0))) || any(greaterThan(plane, vec2(1.0))))) return false;
  precise vec2 uv = plane * frame.right.w;
  // With repeat, whole tiles are dropped here, where it is exact: small uv keep their precision far away.
  ray.uv = WRAP == WRAP_REPEAT ? uv - floor(uv) : uv;
  precise vec2 slope = per_height * frame.position.w;
  ray.slope = slope;
  ray.cosine = -direction.z * inversesqrt(dot(direction, direction));
  ray.footprint = pixel_footprint(per_height, frame.position.z / -direction.z);
  ray.level = 0;
  return true;
}
