#include "bake_common.glsl"

// What the shaders of a certified bake share (kernels/maps/certified_cones.cpp). Theirs is the Bake block of the finer
// grid, whose `size` is in points.

const float WIDE = 3e38;

ivec2 map_size() { return bake.repeats ? bake.size / bake.by : (bake.size - 1) / bake.by + 1; }

// The place of a texel within a side of the map, in a layer of it.
int map_index(ivec2 texel) {
  ivec2 size = map_size();
  ivec2 inside = bake.repeats ? (texel + size) % size : clamp(texel, ivec2(0), size - 1);
  return inside.y * size.x + inside.x;
}
int map_layered(ivec2 texel) {
  ivec2 size = map_size();
  return int(gl_WorkGroupID.z) * size.x * size.y + map_index(texel);
}
