#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_common.glsl"
#include "bake_exact_arithmetic.glsl"

// A texture of a map, from its heights and what its bake left: pack_map (kernels/maps/map_texture.h), whose bytes it
// has. One invocation makes TEXELS_TOGETHER texels, in whole words. CLEAR_FLAG as the argument does that alone.

// clang-format off
layout(BINDING(FIRST_BUFFER_BINDING + 1), std140) uniform Pack {
  DOUBLE relief_depth;
  ivec2 layers;      // of a sector map, across and in all; 0: texels are the map's, or nodes
  ivec4 sources;     // SOURCE_* of each channel
  ivec4 places;      // which of them; of a layer's ratios, in which bits their sector differs; a ratio of -1 is 0
  int channels;      // 1, 2, 4
  int texels;
  int first_word;
  int flag_word;     // 1 where a ratio was cut short
  int texel_stride;  // of values
  int ratio_stride;
  bool is_of_cells;
  bool is_solid;
} pack;
// clang-format on
// Of a solid floors come after the tops.
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) readonly buffer Heights { float heights[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) readonly buffer Values { float values[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 4), std430) writeonly buffer Words { uint words[]; };

float height_at(ivec2 texel) { return heights[index_of(wrapped(texel))]; }
float floor_at(ivec2 texel) { return heights[sides.x * sides.y + index_of(texel)]; }

// To the nearest float: quotients of floats are never so close to half way that a double's rounding matters.
float quotient(float a, float b) { return float(double(a) / double(b)); }

#ifdef HAS_FLOATS
#if CODE_BITS == 16
const uint BIAS = 112u;          // of a float's exponent over a half's
const float SCALE = 16777216.0;  // halves without an exponent are multiples of 2^-24
float value_of(uint code) {
  return code < 1024u ? float(code) * (1.0 / SCALE) : uintBitsToFloat((code << 13) + (BIAS << 23));
}
uint code_of_stored(float value) {
  return value < 1024.0 / SCALE ? uint(value * SCALE) : (floatBitsToUint(value) >> 13) - (BIAS << 10);
}
#else
float value_of(uint code) { return uintBitsToFloat(code); }
uint code_of_stored(float value) { return floatBitsToUint(value); }
#endif
#else
float value_of(uint code) { return quotient(float(code), float(GREATEST_CODE)); }
uint code_of_stored(float value) { return uint(value * float(GREATEST_CODE) + 0.5); }
#endif

#if ENCODED == ENCODED_atan
float tangent(float y) {
  precise float above = y * (15.0 - y * y);
  precise float below = 14.996815 - 5.998726 * y * y;
  return quotient(above, below);
}
#endif

// Encoding::decode (kernels/maps/texel.cpp).
float decode(float stored, float height) {
#if ENCODED == ENCODED_ratio
  return stored;
#elif ENCODED == ENCODED_sqrt
  precise float square = stored * stored;
  return square;
#elif ENCODED == ENCODED_h_tan
  return quotient(stored, max(1.0 - height, LEAST_DEPTH));
#else
  const float HALF_PI = 1.57079632679;
  bool is_wide = stored < 0.5;
  float tan_of = tangent((is_wide ? stored : 1.0 - stored) * HALF_PI);
  return is_wide ? quotient(1.0, max(tan_of, LEAST_TANGENT)) : tan_of;
#endif
}

bool fits(uint code, float ratio, float height) {
  precise float widest = decode(value_of(code), height) * DECODING_GUARD;
  return widest < ratio;
}

// floor_code (kernels/maps/texel.h).
uint floor_code(float ratio, float height) {
  uint low = 0u;
  uint high = CODES;
#ifdef IS_DECREASING
  while (low < high) {
    uint middle = low + (high - low) / 2u;
    if (fits(middle, ratio, height))
      high = middle;
    else
      low = middle + 1u;
  }
  return min(low, CODES - 1u);
#else
  while (high - low > 1u) {
    uint middle = low + (high - low) / 2u;
    if (fits(middle, ratio, height))
      low = middle;
    else
      high = middle;
  }
  return low;
#endif
}

#ifdef HAS_NORMALS
double slope(ivec2 texel, ivec2 along, int side) {
  precise double rise = double(height_at(texel + along)) - double(height_at(texel - along));
  precise double over_two_texels = pack.relief_depth * rise * double(side) * 0.5lf;
  return over_two_texels;
}

// normal_map (kernels/image/normal_map.cpp), along x or y.
uint normal_code(ivec2 texel, int axis) {
  double slope_u = slope(texel, ivec2(1, 0), sides.x);
  double slope_v = slope(texel, ivec2(0, 1), sides.y);
  precise double square = slope_u * slope_u + slope_v * slope_v + 1.0lf;
  double along = axis == 0 ? slope_u : slope_v;
  double share = along == 0.0lf ? 0.0lf : divide(abs(along), square_root(square));
  precise double code = ((along > 0.0lf ? -share : share) * 0.5lf + 0.5lf) * 255.0lf;
  uint whole = uint(code);
  return code - double(whole) >= 0.5lf ? whole + 1u : whole;
}
#endif

float top_of_cell(ivec2 texel) {
  return max(max(height_at(texel), height_at(texel + ivec2(1, 0))),
             max(height_at(texel + ivec2(0, 1)), height_at(texel + 1)));
}

// i: texel of the texture, or node
uint code_of(int source, int place, int i) {
  if (source == SOURCE_NODE) return code_of_stored(values[i * pack.texel_stride + place * pack.ratio_stride]);
  ivec2 texel = ivec2(i % sides.x, i / sides.x);
  if (pack.layers.y > 0) {
    ivec2 tile = sides + 2;  // with its border
    int width = pack.layers.x * tile.x;
    ivec2 at = ivec2(i % width, i / width);
    ivec2 layer = at / tile;
    texel = wrapped(at - layer * tile - 1);
    if (place >= 0) place = (layer.y * pack.layers.x + layer.x) ^ place;
  }
  float height = pack.is_of_cells ? top_of_cell(texel) : height_at(texel);
  if (source == SOURCE_HEIGHT) return code_of_stored(height);
  if (source == SOURCE_FLOOR) return code_of_stored(floor_at(texel));
#ifdef HAS_NORMALS
  if (source == SOURCE_NORMAL) return normal_code(texel, place);
#endif
  float ratio = place < 0 ? 0.0 : values[index_of(texel) * pack.texel_stride + place * pack.ratio_stride];
  if (ratio == CUT_SHORT) words[pack.flag_word] = 1u;
  bool is_down = pack.is_solid && place == 1;
  return floor_code(ratio, is_down ? 1.0 - floor_at(texel) : height);
}

void main() {
  if (argument == CLEAR_FLAG) {
    if (gl_LocalInvocationIndex == 0u) words[pack.flag_word] = 0u;
    return;
  }
  int group = int(gl_WorkGroupID.x) + (first_group_row + int(gl_WorkGroupID.y)) * int(gl_NumWorkGroups.x);
  int first = (group * GROUP_SIDE * GROUP_SIDE + int(gl_LocalInvocationIndex)) * TEXELS_TOGETHER;
  if (first >= pack.texels) return;
  int to = pack.first_word + first / TEXELS_TOGETHER * (pack.channels * CODE_BITS / 8);
  uint word = 0u;
  int bits = 0;
  for (int i = 0; i < TEXELS_TOGETHER; ++i)
    for (int channel = 0; channel < pack.channels; ++channel) {
      int texel = min(first + i, pack.texels - 1);
      word |= code_of(pack.sources[channel], pack.places[channel], texel) << bits;
      bits += CODE_BITS;
      if (bits < 32) continue;
      words[to] = word;
      to += 1;
      word = 0u;
      bits = 0;
    }
}
