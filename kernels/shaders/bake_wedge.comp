#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_search.glsl"

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
  ivec2 place;  // takes the place
};
layout(BINDING(FIRST_BUFFER_BINDING + 4), std430) readonly buffer Wedges { Wedge wedges[]; };

const int IMAGES = 5;  // along an axis, of a map that repeats: the nearest that a wedge sees is at most two tiles away

Wedge seen;
bool sees_whole;  // the owner is on a border behind it: it sees the whole quadrant

// Of this turn.
bool sees_far_borders;  // the borders before the owner, and nothing else
ivec4 normals_x;
ivec4 normals_y;
ivec4 least;

int images() { return repeats ? IMAGES * IMAGES : 1; }

int turns() { return images() + (seen.is_bounded && !sees_whole ? 1 : 0); }
int near_turns() { return 1; }

// 0, 1, -1, 2, -2
int image(int i) { return ((i & 1) == 0 ? -1 : 1) * ((i + 1) >> 1); }

// The borders before an owner who looks that way; -1: none along the axis.
ivec2 borders_before(ivec2 signs) {
  return ivec2(greaterThan(signs, ivec2(0))) * (sides - 1) - ivec2(equal(signs, ivec2(0)));
}

// Each normal's greatest product over a node: of its farthest texel that way.
bvec4 counts(ivec2 first, ivec2 offset, int size) {
  ivec4 x = normals_x * offset.x + max(normals_x, 0) * (size - 1);
  ivec4 y = normals_y * offset.y + max(normals_y, 0) * (size - 1) - least;
  ivec4 next_x = x + normals_x * size;
  ivec4 next_y = y + normals_y * size;
  const ivec4 ZERO = ivec4(0);
  bvec4 sees = bvec4(all(greaterThanEqual(x + y, ZERO)), all(greaterThanEqual(next_x + y, ZERO)),
                     all(greaterThanEqual(x + next_y, ZERO)), all(greaterThanEqual(next_x + next_y, ZERO)));
  if (!sees_far_borders) return sees;
  ivec2 border = borders_before(seen.quadrant) - first;
  bvec2 low = lessThan(uvec2(border), uvec2(size));
  bvec2 high = lessThan(uvec2(border - size), uvec2(size));
  bvec4 on_border = bvec4(low.x || low.y, high.x || low.y, low.x || high.y, high.x || high.y);
  return bvec4(uvec4(sees) & uvec4(on_border));
}

float distance_along(int axis, float offset, float reach) { return max(abs(offset) - reach, 0.0); }

void start_turn(int turn) {
  sees_far_borders = turn == images();
  int row = int((float(turn) + 0.5) / float(IMAGES));
  origin = sees_far_borders ? ivec2(0) : sides * ivec2(image(turn - row * IMAGES), image(row));
  bool sees_quadrant = sees_far_borders || sees_whole;
  normals_x = sees_quadrant ? ivec4(seen.quadrant.x, 0, 0, 0)
                            : ivec4(seen.normals[0].x, seen.normals[1].x, seen.normals[2].x, seen.normals[3].x);
  normals_y = sees_quadrant ? ivec4(0, seen.quadrant.y, 0, 0)
                            : ivec4(seen.normals[0].y, seen.normals[1].y, seen.normals[2].y, seen.normals[3].y);
  least = sees_quadrant ? ivec4(0) : seen.least;
}

// The top of the cell whose corner the owner is.
float top_at(ivec2 corner) {
  float top = 0.0;
  for (int i = 0; i < 4; ++i) top = max(top, height_at(wrapped(owner - corner + ivec2(i & 1, i >> 1))));
  return top;
}

void main() {
  owner = own_texel();
  if (is_outside(owner)) return;
  seen = wedges[gl_WorkGroupID.z];
  pyramid = bake.pyramids == 1 ? 0 : int(gl_WorkGroupID.z) & 3;
  if (seen.is_of_cells) owner = wrapped(owner + seen.corner);
  sees_whole = seen.is_bounded && any(equal(owner, borders_before(-seen.quadrant)));
  start(owner);
  if (seen.is_of_cells) owner_height = top_at(seen.corner);
  search();
}
