#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"

// The least bound of the cells round each point of a finer grid.

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Bounds { float bounds[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) writeonly buffer Limits { float limits[]; };

void main() {
  ivec2 point = own_texel();
  if (is_outside(point)) return;
  ivec2 cells = repeats ? sides : sides - 1;
  float limit = bake.max_ratio;
  for (int i = 0; i < 4; ++i) limit = min(limit, bounds[layered(wrapped(point - ivec2(i & 1, i >> 1), cells))]);
  limits[layered(point)] = limit < 0.0 ? CUT_SHORT : limit * RAISING_GUARD;
}
