// Equal steps from the hit up to the top plate. [RTM] section 5.3, from the hit instead of the light's entry point.
#include "shadow.glsl"
#include "shadow_bias.glsl"

float relief_shadow(Ray ray, Scene scene, inout Hit hit) {
  if (is_under_horizon(scene, hit)) return 0.0;
  LightRay light = light_ray(ray, hit, scene, shadow_bias());
  // At the top plate itself, where one more step would lead, nothing is above the ray.
  for (int i = 1; i <= SHADOW_STEPS; ++i) {
    hit.steps += 1;
    if (light_gap(light, light.top * float(i) / float(SHADOW_STEPS + 1), hit) < 0.0) return 0.0;
  }
  return 1.0;
}
