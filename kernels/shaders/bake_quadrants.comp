#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_search.glsl"

// The exact relaxed cone map [BVBV24], on the pyramids of the four quadrants.

vec2 facing;  // signs of the pyramid's quadrant

int turns() { return 4; }
int near_turns() { return 4; }
void start_turn(int turn) {
  pyramid = turn;
  origin = ivec2(0);
  facing = vec2(1 - 2 * ivec2(turn & 1, turn >> 1));
}

bvec4 counts(ivec2 first, ivec2 offset, int size) { return bvec4(true); }

// distance_to, in the direction that the quadrant faces alone.
float distance_along(int axis, float offset, float reach) {
  const float NEVER = 1e9;
  float first = facing[axis] * offset - reach;
  float last = facing[axis] * offset + reach;
  if (last >= 0.0) return max(first, 0.0);
  return repeats ? max(first + float(sides[axis]), 0.0) : NEVER;
}

void main() {
  owner = own_texel();
  if (is_outside(owner)) return;
  start(owner);
  search();
}
