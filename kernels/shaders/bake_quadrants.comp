#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_least.glsl"

// The exact relaxed cone map [BVBV24], on the pyramids of the four quadrants.

vec2 facing;  // signs of the pyramid's quadrant

int rounds() { return 4; }
int near_rounds() { return 4; }
void start_round(int round) {
  pyramid = round;
  facing = vec2(1 - 2 * ivec2(round & 1, round >> 1));
}

bvec4 counts(ivec2 first, ivec2 x, ivec2 y, int size) { return bvec4(true); }

// distances_to, in the direction that the quadrant faces alone.
vec2 distances_along(int axis, vec2 offsets, float reach) {
  const float NEVER = 1e9;
  vec2 ahead = facing[axis] * offsets;
  vec2 behind = repeats ? max(ahead - reach + float(sides[axis]), 0.0) : vec2(NEVER);
  return mix(behind, max(ahead - reach, 0.0), greaterThanEqual(ahead + reach, vec2(0.0)));
}

void main() {
  if (is_outside(first_texel())) return;
  start(first_texel(), last_texel());
  search();
}
