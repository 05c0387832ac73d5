#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"
#include "bake_pyramid.glsl"

// One level of the pyramids; `argument` says which, and the group's z which pyramid. With the first level, all ratios
// become CUT_SHORT, for the search that follows.

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Heights { float heights[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) buffer Quads { vec4 quads[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) writeonly buffer Ratios { float ratios[]; };

float height_at(ivec2 texel) { return heights[index_of(wrapped(texel))]; }

// limiting_heights (kernels/maps/cone_search.h) at one texel.
float limiting_height(ivec2 texel, ivec2 facing) {
  float near = height_at(texel);
  float across = height_at(texel + ivec2(facing.x, 0));
  float along = height_at(texel + ivec2(0, facing.y));
  float far = height_at(texel + facing);
  bool never_falls = near <= across && near <= along && across <= far && along <= far;
  return never_falls ? NOTHING : near;
}

float node(int pyramid, int level, ivec2 place) {
  if (any(greaterThanEqual(place, nodes_at(level)))) return NOTHING;
  if (level > 0) {
    vec4 below = quads[quad_index(pyramid, level, place)];
    return max(max(below.x, below.y), max(below.z, below.w));
  }
  if (bake.pyramids == 1) return height_at(place);
  return limiting_height(place, 1 - 2 * ivec2(pyramid & 1, pyramid >> 1));
}

void main() {
  ivec2 quad = own_texel();
  int level = argument;
  if (any(greaterThanEqual(quad, nodes_at(level)))) return;
  int pyramid = int(gl_WorkGroupID.z);
  ivec2 first = 2 * quad;
  for (int i = 0; level == 1 && pyramid == 0 && i < 4; ++i) {
    ivec2 texel = first + ivec2(i & 1, i >> 1);
    for (int layer = 0; layer < bake.layers && !is_outside(texel); ++layer)
      ratios[layer * sides.x * sides.y + index_of(texel)] = CUT_SHORT;
  }
  quads[quad_index(pyramid, level, quad)] =
      vec4(node(pyramid, level - 1, first), node(pyramid, level - 1, first + ivec2(1, 0)),
           node(pyramid, level - 1, first + ivec2(0, 1)), node(pyramid, level - 1, first + ivec2(1, 1)));
}
