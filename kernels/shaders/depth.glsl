#ifndef DEPTH_GLSL
#define DEPTH_GLSL
// What depth buffers hold of a depth along the view's axis: far / (far - near) * (1 - near / depth), 0 on the near
// plane and 1 on the far one. Without a difference of like numbers, so that it errs by 2 ulps at most. What lies at the
// far plane or behind has the last float under 1, so that it is drawn where nothing else is.
#include "feature.glsl"

float window_depth(float depth, vec2 planes) {
  if (depth <= planes.x) return 0.0;
  float share = depth < 2.0 * planes.x ? (depth - planes.x) / depth : 1.0 - planes.x / depth;
  return min(share * (planes.y / (planes.y - planes.x)), FARTHEST);
}

float hit_depth(Hit hit, Scene scene) { return scene.eye_depth.x + scene.eye_depth.y * hit.t; }
#endif
