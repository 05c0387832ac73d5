#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_best.glsl"
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

Wedge seen;             // of this turn
bool sees_whole;        // the owner is on a border behind it: it sees the whole quadrant
bool sees_far_borders;  // of this turn: the borders before the owner, and nothing else

int images() { return bake.repeats ? IMAGES * IMAGES : 1; }

int turns() { return images() + (wedges[gl_WorkGroupID.z].is_bounded && !sees_whole ? 1 : 0); }

// 0, 1, -1, 2, -2
int image(int i) { return ((i & 1) == 0 ? -1 : 1) * ((i + 1) / 2); }

// The borders before an owner who looks that way; -1: none along the axis.
ivec2 borders_before(ivec2 signs) {
  return ivec2(greaterThan(signs, ivec2(0))) * (bake.size - 1) - ivec2(equal(signs, ivec2(0)));
}

bool counts(ivec2 first, float size, vec2 offset) {
  ivec2 twice = ivec2(2.0 * offset);
  int reach = int(size) - 1;
  for (int i = 0; i < 4; ++i) {
    ivec2 normal = seen.normals[i];
    ivec2 along = normal * twice + abs(normal) * reach;
    if (along.x + along.y < 2 * seen.least[i]) return false;
  }
  ivec2 border = borders_before(seen.quadrant);
  return !sees_far_borders || any(equal(clamp(border, first, first + reach), border));
}

float distance_along(int axis, float offset, float reach) { return max(abs(offset) - reach, 0.0); }

void try_texel(ivec2 texel, vec2 texels, float top) {
  Arms arms = Arms(texels, texels);
  offer(arms, distance2_of(arms), top);
}

void start_turn(int turn) {
  seen = wedges[gl_WorkGroupID.z];
  pyramid = bake.pyramids == 1 ? 0 : int(gl_WorkGroupID.z) & 3;
  sees_far_borders = turn == images();
  origin = sees_far_borders ? ivec2(0) : bake.size * ivec2(image(turn % IMAGES), image(turn / IMAGES));
  if (sees_far_borders || sees_whole) {
    seen.normals = ivec2[4](ivec2(seen.quadrant.x, 0), ivec2(0, seen.quadrant.y), ivec2(0), ivec2(0));
    seen.least = ivec4(0);
  }
  for (int y = -1; turn == 0 && y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) {
      ivec2 offset = ivec2(x, y);
      ivec2 texel = wrapped(owner + offset);
      bool is_there = bake.repeats || texel == owner + offset;
      if (is_there && counts(texel, 1.0, vec2(offset))) try_texel(texel, abs(vec2(offset)), node_at(pyramid, 0, texel));
    }
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
  Wedge wedge = wedges[gl_WorkGroupID.z];
  if (wedge.is_of_cells) owner = wrapped(owner + wedge.corner);
  sees_whole = wedge.is_bounded && any(equal(owner, borders_before(-wedge.quadrant)));
  start(owner);
  if (wedge.is_of_cells) owner_height = top_at(wedge.corner);
  search();
}
