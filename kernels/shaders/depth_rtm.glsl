// The depth of the hit by the formula of [RTM] listing 5.4, whose depths are negative before the eye: the difference of
// far and near * far / depth, which are alike at the near plane.
#include "depth.glsl"

float relief_window_depth(Ray ray, Scene scene, inout Hit hit) {
  float depth = hit_depth(hit, scene);
  if (depth <= 0.0) return 0.0;
  vec4 planes = vec4(scene.planes, scene.planes.x * scene.planes.y, 1.0 / (scene.planes.y - scene.planes.x));
  return clamp((planes.z / -depth + planes.y) * planes.w, 0.0, FARTHEST);
}
