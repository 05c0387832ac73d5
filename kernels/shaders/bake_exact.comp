#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_least.glsl"

// The exact conservative cone map [DUM06].

int rounds() { return 1; }
int near_rounds() { return 1; }
void start_round(int round) { pyramid = 0; }

bvec4 counts(ivec2 first, ivec2 x, ivec2 y, int size) { return bvec4(true); }

vec2 distances_along(int axis, vec2 offsets, float reach) { return distances_to(offsets, reach, vec2(sides[axis])); }

void main() {
  if (is_outside(first_texel())) return;
  start(first_texel(), last_texel());
  search();
}
