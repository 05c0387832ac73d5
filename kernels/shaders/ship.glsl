#include "common.glsl"

ivec2 map_size() { return textureSize(relief_map, 0); }

// The ray of a fragment.
// uv: where it meets the top plate, in tiles
// view: from the eye to there, in tangent space, of any length; z < 0
// relief_depth: in sides of a tile
#ifdef BENT_RAYS
// curvature: along u, along v and of the product of both ways, per side of a tile
Ray view_ray(vec2 uv, vec3 view, float relief_depth, vec3 curvature) {
  vec2 along = view.xy / -view.z;
  float bend = 0.5 * relief_depth * (dot(curvature.xy, along * along) + curvature.z * along.x * along.y);
  float quadric = bend / max(dot(along, along), 1e-12);
  Ray ray = Ray(uv, along * relief_depth, -normalize(view).z, 0, 1.0, 1.0, 0.0, 1.0, quadric);
  bend_ray(bend, ray);
  return ray;
}
#else
Ray view_ray(vec2 uv, vec3 view, float relief_depth) {
  return Ray(uv, view.xy / -view.z * relief_depth, -normalize(view).z, 0, 1.0);
}
#endif

// Whether a place is off a map that ends.
bool is_beside(vec2 uv) { return any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0))); }

// The image of a fragment at uv.
// eye_distance: from the eye to there, in sides of a tile
Pixel pixel_of(vec2 uv, float eye_distance) {
  vec2 size = vec2(map_size());
  float across = length(dFdx(uv) * size);
  float down = length(dFdy(uv) * size);
  return Pixel(vec2(min(across, down), max(across, down)), eye_distance);
}

// The surface's unit normal in tangent space, from the heights a texel to either side; of any tile, however far.
vec3 relief_normal(const vec2 uv, const float relief_depth) {
  vec2 at = WRAP == WRAP_REPEAT ? fract(uv) : uv;
  vec2 texel = 1.0 / vec2(map_size());
  vec2 rise = vec2(
      textureLod(relief_map, at + vec2(texel.x, 0.0), 0.0).x - textureLod(relief_map, at - vec2(texel.x, 0.0), 0.0).x,
      textureLod(relief_map, at + vec2(0.0, texel.y), 0.0).x - textureLod(relief_map, at - vec2(0.0, texel.y), 0.0).x);
  return normalize(vec3(-0.5 * relief_depth * rise / texel, 1.0));
}
