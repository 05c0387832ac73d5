#version 450
#extension GL_GOOGLE_include_directive : require
#define SEES_IMAGES
#include "bake_least.glsl"

// Exact cones of sectors of directions, a layer each: those of `quad`, of sector maps and of cells. What counts is told
// in whole numbers. See search_wedge (kernels/maps/sector_map.h) for what lies outside a clamped map, and cell_searches
// (kernels/maps/cell_map.h).

// A target at the offset o counts where, for each normal n, n.o >= least; one of length 0 says nothing.
struct Wedge {
  ivec2 normals[4];
  ivec4 least;
  ivec2 quadrant;   // the signs of the quadrant that it is within; one is 0: of the half-plane
  ivec2 corner;     // of the texel's cell, which looks
  bool is_bounded;  // the map ends, and the wedge is not the whole quadrant
  bool is_of_cells;
  bool goes_on;  // with the search before it
  int place;     // takes the place
};
layout(BINDING(FIRST_BUFFER_BINDING + 4), std430) readonly buffer Wedges { Wedge wedges[]; };

Wedge seen;
bvec4 sees_whole;  // owners on a border behind them see the whole quadrant

// Of this round.
bool sees_far_borders;  // the borders before the owners, and nothing else
ivec4 normals_x;
ivec4 normals_y;
ivec4 least;

// The wedge; if it is bounded the borders before owners who see it; and the quadrant, for owners who see it whole.
int rounds() { return seen.is_bounded ? 2 + int(any(sees_whole)) : 1; }
int near_rounds() { return 1; }

// The borders before owners who look that way; -1: none along the axis.
ivec2 borders_before(ivec2 signs) {
  return ivec2(greaterThan(signs, ivec2(0))) * (sides - 1) - ivec2(equal(signs, ivec2(0)));
}

// Each normal's greatest product over a node: of its farthest texel that way.
bvec4 counts(ivec2 first, ivec2 x, ivec2 y, int size) {
  ivec4 farthest = (max(normals_x, 0) + max(normals_y, 0)) * (size - 1) - least;
  ivec4 low_x = normals_x * x[0] + farthest;
  ivec4 high_x = normals_x * x[1] + farthest;
  ivec4 low_y = normals_y * y[0];
  ivec4 high_y = normals_y * y[1];
  const ivec4 ZERO = ivec4(0);
  bvec4 sees = bvec4(all(greaterThanEqual(low_x + low_y, ZERO)), all(greaterThanEqual(high_x + low_y, ZERO)),
                     all(greaterThanEqual(low_x + high_y, ZERO)), all(greaterThanEqual(high_x + high_y, ZERO)));
  if (!sees_far_borders) return sees;
  bool on_border = any(lessThan(uvec2(borders_before(seen.quadrant) - first), uvec2(size)));
  return both(sees, bvec4(on_border));
}

vec2 distances_along(int axis, vec2 offsets, float reach) { return max(abs(offsets) - reach, 0.0); }

void start_round(int round) {
  sees_far_borders = round == 1;
  bool in_quadrant = round > 0;
  normals_x = in_quadrant ? ivec4(seen.quadrant.x, 0, 0, 0)
                          : ivec4(seen.normals[0].x, seen.normals[1].x, seen.normals[2].x, seen.normals[3].x);
  normals_y = in_quadrant ? ivec4(0, seen.quadrant.y, 0, 0)
                          : ivec4(seen.normals[0].y, seen.normals[1].y, seen.normals[2].y, seen.normals[3].y);
  least = in_quadrant ? ivec4(0) : seen.least;
  eyes = mix(owner_heights, vec4(ABOVE_ALL), round == 2 ? not(sees_whole) : sees_whole);
}

// The top of a texel's cell.
float top_at(ivec2 texel) {
  float top = 0.0;
  for (int i = 0; i < 4; ++i) top = max(top, height_at(wrapped(texel + ivec2(i & 1, i >> 1))));
  return top;
}

void main() {
  if (is_outside(first_texel())) return;
  seen = wedges[gl_WorkGroupID.z];
  pyramid = bake.pyramids == 1 ? 0 : int(gl_WorkGroupID.z) & 3;
  if (seen.is_of_cells) {
    start(wrapped(first_texel() + seen.corner), wrapped(last_texel() + seen.corner));
    for (int k = 0; k < 4; ++k)
      if (!is_outside(texel_of(k))) owner_heights[k] = top_at(owner_at(k) - seen.corner);
  } else {
    start(first_texel(), last_texel());
  }
  if (seen.goes_on) go_on();
  ivec2 behind = borders_before(-seen.quadrant);
  bvec4 at_x = equal(owners_x.xyxy, ivec4(behind.x));
  bvec4 at_y = equal(owners_y.xxyy, ivec4(behind.y));
  sees_whole = both(bvec4(seen.is_bounded), either(at_x, at_y));
  search();
}
