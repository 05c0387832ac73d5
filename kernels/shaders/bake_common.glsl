#include "platform.glsl"
#include "bake_contract.glsl"

// What every shader of a bake shares. One invocation makes one texel; the C++ side, which bake_contract.glsl is
// generated from, is backends/gpu_bake.cpp.

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;

#ifdef HAS_DOUBLES
#define DOUBLE double
#else
#define DOUBLE uvec2  // takes the place
#endif

layout(BINDING(DISPATCH_BINDING), std430) readonly buffer Dispatch {
  int first_group_row;
  int argument;
};
// clang-format off
layout(BINDING(FIRST_BUFFER_BINDING), std140) uniform Bake {
  DOUBLE weight_x;  // see ConeMetric (kernels/maps/cone_search.h)
  DOUBLE weight_y;
  DOUBLE slack;
  DOUBLE side;
  DOUBLE widest_key;      // of the widest ratio allowed
  DOUBLE diagonal;        // of a texel, in uv
  float aspect;           // weight_x in units of weight_y
  float slack_in_rows;    // slack in units of weight_y, rounded up
  float widest_in_rows;   // widest_key in units of weight_y
  float rows_to_ratio;    // root of a key in units of weight_y to its ratio; rounded down
  ivec2 size;             // texels
  int top_level;          // of the pyramid: its only quad or node
  int pyramids;           // 1 of all texels; or 4, of those that count in the quadrants ++, -+, +-, --
  int pyramid_quads;      // from one pyramid to the next
  int layers;             // of ratios
  bool repeats;           // the map is tiled
  bool exact_distances;   // squared distances in units of weight_y have no rounding in float
  bool is_of_cells;       // nodes of a mip chain are of the cells between texels
  int search_steps;       // relaxed_po07
  float step_share;       // 1 / search_steps
  bool is_interpolated;   // the map is to be right between texels
  float guard;            // of a finer grid: see rise_guard (kernels/maps/cone_bounds.h)
  float max_ratio;        // the widest ratio allowed
  ivec2 by;               // points a texel of the map that a finer grid is of
  // Of quads, [i] is level i + 1; of shapes and mip chains, level i. xy: its first one, those from row to row
  ivec4 levels[MOST_LEVELS];
} bake;
// clang-format on

const float WIDE = 3e38;  // over all ratios and keys

// What loops ask for. llvmpipe loads what is in a block lane by lane, and anew in every turn of a loop.
ivec2 sides = bake.size;
bool repeats = bake.repeats;
int top_level = bake.top_level;

// The texel of this invocation; it may be outside the map. Eight invocations in a row, which some devices run together,
// have 4 x 2 texels: those take like times.
ivec2 own_texel() {
  ivec2 group = ivec2(gl_WorkGroupID.x, first_group_row + int(gl_WorkGroupID.y));
  int i = int(gl_LocalInvocationIndex);
  return group * GROUP_SIDE + ivec2((i & 3) | ((i >> 1) & 4), ((i >> 2) & 1) | ((i >> 3) & 6));
}
bool is_outside(ivec2 texel) { return any(greaterThanEqual(texel, sides)); }
int index_of(ivec2 texel) { return texel.y * sides.x + texel.x; }
// Of a ratio, where a dispatch has a layer of them for each of its groups' z.
int layered(ivec2 texel) { return int(gl_WorkGroupID.z) * sides.x * sides.y + index_of(texel); }

// A texel within a side of the map, or of another grid, brought into it.
ivec2 wrapped(ivec2 texel, ivec2 grid) {
  if (!repeats) return clamp(texel, ivec2(0), grid - 1);
  texel += grid * ivec2(lessThan(texel, ivec2(0)));
  return texel - grid * ivec2(greaterThanEqual(texel, grid));
}
ivec2 wrapped(ivec2 texel) { return wrapped(texel, sides); }
