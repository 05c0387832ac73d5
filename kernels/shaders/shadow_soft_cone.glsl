// Shadows that are sharp where they touch what casts them and wider with the distance: of all looks on the way up, the
// one that is nearest to the relief for its distance tells the share of the light's disc that is free, as over a
// straight edge. Between looks the ray goes as far as the cone under it is free for the disc's lower rim, or one equal
// step.
#include "cone_sample.glsl"
#include "shadow.glsl"
#include "shadow_bias.glsl"

// Share of a disc over a line that is x radii under its middle; within 0.04 of the exact one.
float disc_share(float x) {
  x = clamp(x, -1.0, 1.0);
  return 0.5 + x * (0.75 - 0.25 * x * x);
}

float relief_shadow(Ray ray, Scene scene, inout Hit hit) {
  if (is_under_horizon(scene, hit)) return 0.0;
  LightRay light = light_ray(ray, hit, scene, shadow_bias());
  // By what a ray that has risen by s must clear the relief, over s, so that the whole disc is free: it goes down by
  // radius / cos^2 for each unit of level distance, of which it takes cos / sin to rise by one.
  float level = max(length(scene.light.xy), scene.light_radius);
  float spread = scene.light_radius / (scene.light.z * max(level, 1e-6));
  float rim_ratio = length(light.path.slope) * (1.0 + spread);
  float least_step = light.top / float(SHADOW_STEPS);
  float share = 1.0;
  float s = 0.0;
  for (int i = 0; i < SHADOW_STEPS; ++i) {
    hit.steps += 1;
    Relief relief = sample_relief(light.path, s, SHAPE_CONE, 0, hit.taps);
    float gap = light.z + s - relief.height;
    if (s > 0.0) {
      if (spread * s > 0.0) {
        share = min(share, disc_share(gap / (spread * s)));
      } else if (gap < 0.0) {
        share = 0.0;
      }
    }
    gap = max(gap, 0.0);
    if (share <= 0.0 || relief.ratio >= rim_ratio) break;
    s += max(relief.ratio * gap / (rim_ratio - relief.ratio), least_step);
    if (s >= light.top) break;
  }
  return share;
}
