#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"

// One level of a mip chain, `argument`: the highest top under each node and, of a solid, in another layer its lowest
// floor. Level 0 is texels or cells: maximum_levels (kernels/maps/pyramid_map.h), bake_double_mip.

// Of a solid floors come after the tops.
layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Heights { float heights[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) buffer Nodes { float nodes[]; };

bool is_solid = bake.layers > 1;

ivec2 sides_at(int level) { return max(sides >> level, ivec2(1)); }
int node_index(int level, ivec2 node) {
  ivec4 place = bake.levels[level];
  return int(gl_WorkGroupID.z) * bake.pyramid_quads + place.x + node.y * place.y + node.x;
}

bool has_floors() { return gl_WorkGroupID.z > 0u; }
float nothing() { return has_floors() ? 1.0 : 0.0; }
float farther(float one, float other) { return has_floors() ? min(one, other) : max(one, other); }

float cell(ivec2 first) {
  float found = nothing();
  bool is_thick = !is_solid;
  for (int i = 0; i < 4; ++i) {
    int corner = index_of(wrapped(first + ivec2(i & 1, i >> 1)));
    float top = heights[corner];
    float bottom = is_solid ? heights[sides.x * sides.y + corner] : top;
    is_thick = is_thick || top > bottom;
    found = farther(found, has_floors() ? bottom : top);
  }
  return is_thick ? found : nothing();
}

// Sides round down: the last node has what is left.
float parent(int level, ivec2 node) {
  ivec2 below = sides_at(level - 1);
  ivec2 end = mix(2 * node + 2, below, equal(node, sides_at(level) - 1));
  float found = nothing();
  for (int y = 2 * node.y; y < end.y; ++y)
    for (int x = 2 * node.x; x < end.x; ++x) found = farther(found, nodes[node_index(level - 1, ivec2(x, y))]);
  return found;
}

void main() {
  ivec2 node = own_texel();
  if (any(greaterThanEqual(node, sides_at(argument)))) return;
  float found;
  if (argument > 0)
    found = parent(argument, node);
  else
    found = bake.is_of_cells ? cell(node) : heights[index_of(node)];
  nodes[node_index(argument, node)] = found;
}
