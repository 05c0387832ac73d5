#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_search.glsl"

// The exact conservative cone map [DUM06]; on the pyramids of the four quadrants, the exact relaxed one [BVBV24].

ivec2 facing;  // signs of the pyramid's quadrant; 0: all texels count

int turns() { return bake.pyramids; }
int near_turns() { return turns(); }

bvec4 counts(ivec2 first, ivec2 offset, int size) { return bvec4(true); }

// distance_to, in the direction that the pyramid's quadrant faces alone.
float distance_along(int axis, float offset, float reach) {
  float side = float(bake.size[axis]);
  int sign = facing[axis];
  if (sign == 0) return distance_to(offset, reach, side);
  const float NEVER = 1e9;
  float first = float(sign) * offset - reach;
  float last = float(sign) * offset + reach;
  if (first >= 0.0) return first;
  if (last >= 0.0) return 0.0;
  return bake.repeats ? max(first + side, 0.0) : NEVER;
}

void start_turn(int turn) {
  pyramid = turn;
  origin = ivec2(0);
  facing = bake.pyramids == 1 ? ivec2(0) : 1 - 2 * ivec2(pyramid & 1, pyramid >> 1);
}

void main() {
  owner = own_texel();
  if (is_outside(owner)) return;
  start(owner);
  search();
}
