#ifndef EYE_GLSL
#define EYE_GLSL
// Depths along the view's axis, in sides of the unit square: the ray of a pixel is at position + eye_direction * depth.
#include "frame_block.glsl"

vec2 near_and_far() { return vec2(frame.up.w, frame.up.w * DEPTH_RANGE); }

// Of the ray: where it enters at the top plate, and what is added as far as the bottom plate.
vec2 eye_depth(vec2 pixel) {
  return vec2(frame.position.z, frame.position.w / frame.right.w) / -eye_direction(pixel).z;
}
#endif
