#ifndef SHADOW_GLSL
#define SHADOW_GLSL
// The relief's shadow on itself: what a hit sees of the light.
#include "feature.glsl"

// The way from a hit to the light. When it has risen by s it is at path.uv + path.slope s, in the height z + s.
struct LightRay {
  Ray path;   // slope: uv per unit of height that it rises
  float z;    // height where it begins
  float top;  // s at the top plate, over which there is no relief
};

Ray straight_ray(vec2 uv, vec2 slope, int level) {
#ifdef BENT_RAYS
  return Ray(uv, slope, 1.0, level, 1.0, 1.0, 0.0, 1.0, 0.0);
#else
  return Ray(uv, slope, 1.0, level, 1.0);
#endif
}

// True of every hit, but not known of a whole draw: of one that branches on what all its pixels share lavapipe makes
// the shader anew.
bool is_there(Hit hit) { return hit.t < 1e30; }

bool is_under_horizon(Scene scene, Hit hit) { return scene.light.z <= 0.0 && is_there(hit); }

// The height of a hit in what is left of the relief, which way.glsl shrinks towards the polygon.
float height_of_hit(Ray ray, Hit hit) {
  if (ray.relief <= 0.0) return 1.0;
  return RAY_HEIGHT(ray, (hit.t - polygon_t() * (1.0 - ray.relief)) / ray.relief);
}

// On the level of the map and in the relief that the hit was found on.
// lift: of the beginning over the hit, in heights
LightRay light_ray(Ray ray, Hit hit, Scene scene, float lift) {
  float depth = scene.relief_depth * ray.relief;
  vec2 slope = mix(vec2(0.0), scene.light.xy / scene.light.z * depth, bvec2(is_there(hit)));
  float z = min(height_of_hit(ray, hit) + lift, 1.0);
  return LightRay(straight_ray(ray.uv + ray.slope * hit.t, slope, ray.level), z, 1.0 - z);
}

// How far the ray is above the surface when it has risen by s.
float light_gap(LightRay light, float s, inout Hit hit) {
  return light.z + s - sample_map(relief_map, light.path.uv + light.path.slope * s, light.path.level, hit.taps).x;
}

void shade_shadow(float share, inout Shading shading) { shading.direct *= share; }
#endif
