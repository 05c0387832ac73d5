#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_search.glsl"

// The exact conservative cone map [DUM06].

int turns() { return 1; }
int near_turns() { return 1; }
void start_turn(int turn) {
  pyramid = 0;
  origin = ivec2(0);
}

bvec4 counts(ivec2 first, ivec2 offset, int size) { return bvec4(true); }

float distance_along(int axis, float offset, float reach) { return distance_to(offset, reach, float(sides[axis])); }

void main() {
  owner = own_texel();
  if (is_outside(owner)) return;
  start(owner);
  search();
}
