#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_search.glsl"

// The exact conservative cone map [DUM06]; on the pyramids of the four quadrants, the exact relaxed one [BVBV24].
double pair_key(Pair pair) {
  precise double rise2 = pair.rise * pair.rise;
  return divide(pair.distance2, rise2);
}
