// A few taps between the hit and the top plate, none of which ends the search: the one that stands highest over the ray
// says how dark it is, and counts for more the nearer to the hit it is. The light's size plays no part.
#include "shadow.glsl"
#include "shadow_bias.glsl"

float relief_shadow(Ray ray, Scene scene, inout Hit hit) {
  if (is_under_horizon(scene, hit)) return 0.0;
  LightRay light = light_ray(ray, hit, scene, shadow_bias());
  // What stands over the ray by as much as it rises from tap to tap is dark, next to the hit by half of that.
  float strength = 2.0 / max(light.top, 1e-6);
  float darkness = 0.0;
  for (int i = 1; i <= SHADOW_STEPS; ++i) {
    hit.steps += 1;
    float over = -light_gap(light, light.top * float(i) / float(SHADOW_STEPS + 1), hit);
    darkness = max(darkness, over * strength * float(SHADOW_STEPS + 1 - i));
  }
  return 1.0 - min(darkness, 1.0);
}
