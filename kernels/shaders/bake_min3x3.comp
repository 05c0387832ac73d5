#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"

// The least ratio of each texel and its eight neighbours, in every layer: min3x3 (kernels/maps/cone_map.h).

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Ratios { float ratios[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) writeonly buffer Least { float least[]; };

void main() {
  ivec2 texel = own_texel();
  if (is_outside(texel)) return;
  float ratio = ratios[layered(texel)];
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) ratio = min(ratio, ratios[layered(wrapped(texel + ivec2(x, y)))]);
  least[layered(texel)] = ratio;
}
