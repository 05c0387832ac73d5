#include "bake_common.glsl"
#include "bake_pyramid.glsl"
#ifdef HAS_DOUBLES
#include "bake_exact_arithmetic.glsl"
#endif

// What every shader has that makes a cone map's ratios. A ratio is the root of the least key of all higher texels,
// distance^2 / rise^2. Keys are compared in float, in units of weight_y; double precision decides where float's
// rounding could, so that a ratio has the bits of the bakers in kernels/.

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Heights { float heights[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2)) uniform samplerBuffer quads;
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) buffer Ratios { float ratios[]; };

float aspect = bake.aspect;
float slack_in_rows = bake.slack_in_rows;
bool exact_distances = bake.exact_distances;
#ifdef HAS_DOUBLES
double weight_x = bake.weight_x;
double weight_y = bake.weight_y;
double slack = bake.slack;
double widest_key = bake.widest_key;
#endif

// A key in float is off by less than this share of it. The worst is the distance of a direct neighbour under `safe`, on
// a map 1.5 times as long as wide: taking off the slack leaves a fifth of it, and so five times its share of rounding.
const float KEY_ERROR = 2e-6;

float node_at(int pyramid, int level, ivec2 node) {
  return texelFetch(quads, quad_index(pyramid, level + 1, node >> 1))[2 * (node.y & 1) + (node.x & 1)];
}
float height_at(ivec2 texel) { return heights[index_of(texel)]; }

#ifdef HAS_DOUBLES
float ratio_of(double key) { return rounded_down(divide(square_root(key), bake.side)); }
#endif

// From texels to boxes whose middles are at the offsets along axes of these sides, and that reach `reach` to both
// sides.
vec2 distances_to(vec2 offsets, float reach, vec2 side) {
  vec2 middles = abs(offsets);
  if (repeats) middles = min(middles, side - middles);
  return max(middles - reach, 0.0);
}
