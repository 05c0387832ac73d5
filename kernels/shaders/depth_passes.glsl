// Relief mapping by depth slices as passes: a draw for each plane, which drops pixels where the plane is above the
// surface. Later ones are nearer and overwrite. [RTM] section 5.2, listing 5.2
#include "eye.glsl"
#include "refine.glsl"

// Where the ray meets a plane that faces the camera, of a lattice with as many of them in the middle of the frame as
// there are passes: the slice-th behind the ray's entry. Over 1: it is under the bottom plate.
float facing_plane(int slice) {
  vec2 eye = eye_depth(gl_FragCoord.xy);
  float apart = frame.position.w / frame.right.w / (max(-frame.forward.z, 1e-3) * float(PASSES));
  return max(((floor(eye.x / apart) + float(slice)) * apart - eye.x) / eye.y, 0.0);
}

Hit trace(Ray ray) {
  int slice = PASSES - int(frame.forward.w);
  Hit hit = Hit(float(slice) / float(PASSES), STATUS_HIT, 0, PASSES);
  // The last plane is the bottom plate whatever the others are, so that every ray ends.
  if (FACING == FACING_CAMERA) hit.t = mix(hit.t, facing_plane(slice), slice < PASSES);
  float gap = gap_at(ray, hit.t, hit);
  bool is_under = hit.t <= 1.0 && gap <= 0.0;
  if (!is_under) discard;
  // The same again, but not known of the whole draw: lavapipe makes a shader for each value that a branch hangs on.
  hit.t = mix(1.0, hit.t, is_under);
  hit.taps *= PASSES;  // those of the other passes, too
  return hit;
}
