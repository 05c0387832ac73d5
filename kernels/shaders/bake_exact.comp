#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_best.glsl"
#include "bake_search.glsl"

// The exact conservative cone map [DUM06]; on the pyramids of the four quadrants, the exact relaxed one [BVBV24].

void try_texel(ivec2 texel, vec2 texels, float top) {
  Arms arms = Arms(texels, texels);
  offer(arms, distance2_of(arms), top);
}

void main() {
  owner = own_texel();
  if (is_outside(owner)) return;
  start(owner);
  search();
}
