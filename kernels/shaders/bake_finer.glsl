#include "bake_common.glsl"

// What the shaders of a certified bake share (kernels/maps/certified_cones.cpp). Theirs is the Bake block of the finer
// grid, whose `size` is in points.

ivec2 by = bake.by;
ivec2 map_sides = repeats ? sides / by : (sides - 1) / by + 1;

// The place of a texel within a side of the map, in a layer of it.
int map_index(ivec2 texel) {
  ivec2 inside = wrapped(texel, map_sides);
  return inside.y * map_sides.x + inside.x;
}
int map_layered(ivec2 texel) { return int(gl_WorkGroupID.z) * map_sides.x * map_sides.y + map_index(texel); }
