#include "kernels/maps/texel.h"

#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string>

#include "kernels/base/error.h"
#include "kernels/base/suggest.h"
#include "kernels/maps/block_codec.h"
#include "kernels/maps/map_kind.h"

namespace reliefbench {
namespace {

constexpr std::array kFormats{
    Format{.id = "r8", .type = TexelType::unorm8, .channels = 1},
    Format{.id = "r16", .type = TexelType::unorm16, .channels = 1},
    Format{.id = "r16f", .type = TexelType::float16, .channels = 1},
    Format{.id = "r32f", .type = TexelType::float32, .channels = 1},
    Format{.id = "rg8", .type = TexelType::unorm8, .channels = 2},
    Format{.id = "rg16", .type = TexelType::unorm16, .channels = 2},
    Format{.id = "rg16f", .type = TexelType::float16, .channels = 2},
    Format{.id = "rg32f", .type = TexelType::float32, .channels = 2},
    Format{.id = "rgba8", .type = TexelType::unorm8, .channels = 4, .with_normal = true},
    Format{.id = "r8+r8", .type = TexelType::unorm8, .channels = 1, .extra_channels = 1},
    Format{.id = "r8+rgba8", .type = TexelType::unorm8, .channels = 1, .extra_channels = 4},
    Format{.id = "r16+rgba16", .type = TexelType::unorm16, .channels = 1, .extra_channels = 4},
    Format{.id = "r16f+rgba16f", .type = TexelType::float16, .channels = 1, .extra_channels = 4},
    Format{.id = "r32f+rgba32f", .type = TexelType::float32, .channels = 1, .extra_channels = 4},
    Format{.id = "bc4", .type = TexelType::rgtc, .channels = 1},
    Format{.id = "bc5", .type = TexelType::rgtc, .channels = 2},
    Format{.id = "eac_r11", .type = TexelType::eac, .channels = 1},
    Format{.id = "eac_rg11", .type = TexelType::eac, .channels = 2},
    Format{.id = "bc7", .type = TexelType::bc7, .channels = 2},
    Format{.id = "astc", .type = TexelType::astc, .channels = 2},
};

/// tan(y) for y in [0, pi/4] by its Pade approximant [3/2], scaled to 1 at the end, within 2.2e-4: the encoding is what
/// it decodes to, and these few operations are the same on every device, where a driver's tan is not.
template <typename Real>
Real tangent(Real y) {
  return y * (15.0F - y * y) / (14.996815F - 5.998726F * y * y);
}

template <typename Real>
Real decode_ratio(Real stored, Real /*height*/) {
  return stored;
}

template <typename Real>
Real decode_sqrt(Real stored, Real /*height*/) {
  return stored * stored;
}

/// stored = angle between the cone's generatrix and the plane, over pi/2: 1 closed, 1/2 at ratio 1. Both halves meet
/// there with one slope, so that a code between two never means a wider cone than the line between theirs.
template <typename Real>
Real decode_atan(Real stored, Real /*height*/) {
  constexpr float kHalfPi = 1.57079632679F;
  return stored < 0.5F ? 1.0F / std::max<Real>(tangent(stored * kHalfPi), 1.0F / kUnboundedRatio)
                       : tangent((1.0F - stored) * kHalfPi);
}

/// stored = radius of the cone at the top plate, (1 - height) ratio. At the plate itself no cone is needed.
template <typename Real>
Real decode_h_tan(Real stored, Real height) {
  return stored / std::max<Real>(1.0F - height, kLeastDepth);
}

constexpr float kDivisionGuard = 1 + 0x1p-20F;  // divisions on GPUs are 2.5 ulp off, a few of them in a row

constexpr std::array kEncodings{
    Encoding{
        .id = "ratio", .shader_value = 0, .source = "[DUM06]", .decode = decode_ratio, .decode_exact = decode_ratio},
    Encoding{.id = "sqrt", .shader_value = 1, .source = "[PO07]", .decode = decode_sqrt, .decode_exact = decode_sqrt},
    Encoding{.id = "h_tan",
             .shader_value = 2,
             .source = "[HSST08]",
             .decode = decode_h_tan,
             .decode_exact = decode_h_tan,
             .is_over_depth = true,
             .guard = kDivisionGuard},
    Encoding{.id = "atan",
             .shader_value = 3,
             .source = "angle of the cone, over pi/2",
             .decode = decode_atan,
             .decode_exact = decode_atan,
             .is_decreasing = true,
             .guard = kDivisionGuard},
};

}  // namespace

int Format::bits_per_texel() const {
  return static_cast<int>(level_bytes(relief(), 4, 4) + level_bytes(extra(), 4, 4)) / 2;
}

std::span<const Format> formats() { return kFormats; }
const Format& find_format(std::string_view id) { return find_row(formats(), "texture format", id); }

std::span<const Encoding> encodings() { return kEncodings; }
const Encoding& find_encoding(std::string_view id) { return find_row(encodings(), "cone encoding", id); }

float value_of(std::uint32_t code, TexelType type) {
  switch (type) {
    case TexelType::unorm8:
    case TexelType::unorm16:
    case TexelType::rgtc:
    case TexelType::eac:
    case TexelType::bc7:
    case TexelType::astc:
      return static_cast<float>(code) / static_cast<float>(greatest_code(type));
    case TexelType::float16:
      return half(half::FromBits, static_cast<std::uint16_t>(code));
    case TexelType::float32:
      return std::bit_cast<float>(code);
  }
  return 0;
}

float value_spread(TexelType type) {
  if (type == TexelType::astc) return kAstcSpread;
  return type == TexelType::eac ? kEacSpread : 0;
}

std::uint32_t nearest_code(float value, TexelType type) {
  switch (type) {
    case TexelType::unorm8:
    case TexelType::unorm16:
    case TexelType::rgtc:
    case TexelType::eac:
    case TexelType::bc7:
    case TexelType::astc:
      return static_cast<std::uint32_t>(std::lround(double{value} * greatest_code(type)));
    case TexelType::float16:
      return half(value).bits();
    case TexelType::float32:
      return std::bit_cast<std::uint32_t>(value);
  }
  return 0;
}

Heightfield quantise_heights(const Heightfield& heights, TexelType type) {
  if (is_of_blocks(type)) return heights_in_blocks(heights, type, BlockRounding::nearest);
  Heightfield quantised = heights;
  for (std::vector<float>* values : {&quantised.texels, &quantised.floors})
    for (float& height : *values) height = value_of(nearest_code(height, type), type);
  return quantised;
}

std::uint32_t code_count(TexelType type, const Encoding& encoding) {
  return nearest_code(is_float(type) && !encoding.is_decreasing ? kUnboundedRatio : 1.0F, type) + 1;
}

std::uint32_t floor_code(float ratio, float height, TexelType type, const Encoding& encoding) {
  const std::uint32_t end = code_count(type, encoding);
  const float spread = value_spread(type);
  const auto fits = [&](std::uint32_t code) {
    const float widest = value_of(code, type) + (encoding.is_decreasing ? -spread : spread);
    return encoding.decode(widest, height + spread) * encoding.guard < ratio;
  };
  std::uint32_t low = 0;
  std::uint32_t high = end;
  if (encoding.is_decreasing) {  // the least code that fits; the last one if none does
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      if (fits(middle)) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    return std::min(low, end - 1);
  }
  while (high - low > 1) {  // the greatest code that fits; 0 if none does
    const std::uint32_t middle = low + (high - low) / 2;
    (fits(middle) ? low : high) = middle;
  }
  return low;
}

float floor_ratio(float ratio, float height, TexelType type, const Encoding& encoding) {
  return encoding.decode(value_of(floor_code(ratio, height, type, encoding), type), height);
}

}  // namespace reliefbench
