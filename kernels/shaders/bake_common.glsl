#include "platform.glsl"
#include "bake_contract.glsl"

// What every cone-map baker shares. One invocation bakes one texel; the C++ side, which bake_contract.glsl is generated
// from, is backends/gpu_bake.cpp. Results are keys in double precision, so that they have the bits of the bakers in
// kernels/: they need additions and products that round correctly, and no more than that.

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;

// The least squared distance over squared rise of each texel, in the unit of `bake`.
layout(BINDING(OUTPUT_BINDING), std430) writeonly buffer Keys { double keys[]; };
layout(BINDING(BAND_BINDING), std430) readonly buffer Band { int first_group_row; };
// clang-format off
layout(BINDING(FIRST_INPUT_BINDING), std430) readonly buffer Bake {
  double weight_x;  // see ConeMetric (kernels/maps/cone_search.h)
  double weight_y;
  double slack;
  double widest_key;  // of the widest ratio allowed
  ivec2 size;         // texels
  int root;           // level of a pyramid's last node
  int search_steps;   // relaxed_po07
  int pyramids;       // 1 of all texels; or 4, of those that count in the quadrants ++, -+, +-, --
  int pyramid_nodes;  // from one pyramid to the next
  int heights;        // first node of the map's heights, laid out as level 0
  bool repeats;       // the map is tiled
  int footpoint;      // FOOTPOINT_*
  int padding;
  ivec2 levels[];  // of a pyramid: first node, nodes from row to row
} bake;
// clang-format on
layout(BINDING(FIRST_INPUT_BINDING + 1), std430) readonly buffer Pyramids { float nodes[]; };

float node_at(int pyramid, int level, ivec2 node) {
  ivec2 place = bake.levels[level];
  return nodes[pyramid * bake.pyramid_nodes + place.x + node.y * place.y + node.x];
}

double height_at(ivec2 texel) { return double(nodes[bake.heights + texel.y * bake.levels[0].y + texel.x]); }

// The texel of this invocation; it may be outside the map.
ivec2 own_texel() {
  ivec2 group = ivec2(gl_WorkGroupID.x, first_group_row + int(gl_WorkGroupID.y));
  return group * ivec2(gl_WorkGroupSize.xy) + ivec2(gl_LocalInvocationID.xy);
}

void store_key(ivec2 texel, double key) { keys[texel.y * bake.size.x + texel.x] = key; }

// A texel within a side of the map, brought into it.
ivec2 wrapped(ivec2 texel) {
  return bake.repeats ? (texel + bake.size) % bake.size : clamp(texel, ivec2(0), bake.size - 1);
}

// a - q b without error, q within an ulp or so of a / b: Dekker's product of Veltkamp's halves.
double residual(double a, double b, double q) {
  const double SPLIT = 134217729.0lf;  // 2^27 + 1
  precise double scaled_q = q * SPLIT;
  precise double high_q = scaled_q - (scaled_q - q);
  precise double low_q = q - high_q;
  precise double scaled_b = b * SPLIT;
  precise double high_b = scaled_b - (scaled_b - b);
  precise double low_b = b - high_b;
  precise double product = q * b;
  precise double error = ((high_q * high_b - product) + high_q * low_b + low_q * high_b) + low_q * low_b;
  precise double rest = (a - product) - error;
  return rest;
}

// The double after q > 0, or the one before it.
double neighbour(double q, bool above) {
  uvec2 bits = unpackDouble2x32(q);
  if (above) {
    bits.x += 1u;
    if (bits.x == 0u) bits.y += 1u;
  } else {
    if (bits.x == 0u) bits.y -= 1u;
    bits.x -= 1u;
  }
  return packDouble2x32(bits);
}

// a / b, rounded to nearest, for a, b > 0; APIs let a device's own division be some ulps off.
double divide(double a, double b) {
  precise double q = a / b;
  q = q + residual(a, b, q) / b;  // now the nearest double or, close to a tie, its neighbour
  double rest = residual(a, b, q);
  if (rest == 0.0lf) return q;
  double other = neighbour(q, rest > 0.0lf);
  return abs(residual(a, b, other)) < abs(rest) ? other : q;
}
