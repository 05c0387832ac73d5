// The depth of the hit in place of the plate's.
#include "depth.glsl"

float relief_window_depth(Ray ray, Scene scene, inout Hit hit) {
  return window_depth(hit_depth(hit, scene), scene.planes);
}
