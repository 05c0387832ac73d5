// Down from where the light comes through the top plate: equal steps until the ray is under the relief, then halving. A
// hit is in shadow where that meets the relief before it, by more than a threshold. [RTM] listing 5.3
#include "linear_search.glsl"
#include "shadow.glsl"

// Of the relief's height: 0, 1/1024, 1/256 or 1/64.
float shadow_threshold() {
  return SHADOW_THRESHOLD == SHADOW_THRESHOLD_NONE ? 0.0 : exp2(float(2 * SHADOW_THRESHOLD - 12));
}

float relief_shadow(Ray ray, Scene scene, inout Hit hit) {
  if (is_under_horizon(scene, hit)) return 0.0;
  LightRay light = light_ray(ray, hit, scene, 0.0);
  Ray entry = straight_ray(light.path.uv + light.path.slope * light.top, -light.path.slope, light.path.level);
  Bracket bracket;
  Hit met;
  if (linear_search(entry, float(SHADOW_STEPS), 1.0, bracket, met)) refine_binary(entry, bracket, SHADOW_HALVINGS, met);
  hit.taps += met.taps;
  hit.steps += met.steps;
  return met.t < light.top - shadow_threshold() ? 0.0 : 1.0;
}
