#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "kernels/image/heightfield.h"
#include "kernels/image/texture_image.h"

namespace reliefbench {

/// How a relief map is spread over textures, one row. The relief texture has the height first, then, if it has more
/// channels, the cone ratio; with_normal: then x and y of the normal. The extra texture holds what is kept apart: the
/// ratios, or a pyramid, volume or table, or sectors (those have the format's whole layout).
struct Format {
  std::string_view id;
  TexelType type;
  int channels;            ///< of the relief texture
  int extra_channels = 0;  ///< of the extra texture
  bool with_normal = false;
  [[nodiscard]] int ratios() const { return with_normal ? 1 : channels - 1 + extra_channels; }
  [[nodiscard]] TexelLayout relief() const { return {.type = type, .channels = channels}; }
  [[nodiscard]] TexelLayout extra() const { return {.type = type, .channels = extra_channels}; }
  [[nodiscard]] int bits_per_texel() const;  ///< of both textures
};
[[nodiscard]] std::span<const Format> formats();
[[nodiscard]] const Format& find_format(std::string_view id);  ///< throws: Error(bad_input) listing the choices

/// Depth under the top plate that h_tan divides by at least.
inline constexpr float kLeastDepth = 0x1p-16F;

/// How a cone ratio becomes a stored value. `shader_value` is the ENCODING specialization constant.
struct Encoding {
  std::string_view id;
  int shader_value;
  std::string_view source;
  float (*decode)(float stored, float height);           ///< the shader's arithmetic, in float
  double (*decode_exact)(double stored, double height);  ///< the same but for float's rounding
  bool is_decreasing = false;                            ///< greater codes are narrower cones
  bool is_over_depth = false;                            ///< decoding divides by the depth under the top plate
  float guard = 1;  ///< greatest factor by which a shader's rounding may widen the decoded ratio
};
[[nodiscard]] std::span<const Encoding> encodings();
[[nodiscard]] const Encoding& find_encoding(std::string_view id);  ///< throws: Error(bad_input) listing the choices

/// A code is the bits as stored; in blocks, what they decode to. For values >= 0 all types are ordered as their codes
/// are.
[[nodiscard]] float value_of(std::uint32_t code, TexelType type);
/// What a device's value may differ by from value_of(), where its API lets it choose; ends are exact. Ratios are
/// floored so that they are safe whatever it chooses.
[[nodiscard]] float value_spread(TexelType type);
/// The code of the value nearest to `value` (in [0, 1] for unorms); halves: ties to even.
[[nodiscard]] std::uint32_t nearest_code(float value, TexelType type);

/// Heights as the GPU will read them back: rounded to the nearest code of `type`, or to the nearest blocks, decoded.
/// Cones are built from these, never from the unquantised heights.
[[nodiscard]] Heightfield quantise_heights(const Heightfield& heights, TexelType type);

/// How many codes there are for ratios: an angle's end at 1, all others where the type, or kUnboundedRatio, does.
[[nodiscard]] std::uint32_t code_count(TexelType type, const Encoding& encoding);
/// The code of the widest cone that `type` can hold whose decoded ratio, with a guard, is below `ratio`; the narrowest
/// cone's code if none is. The guard is one ulp, for samplers whose unorm conversion is an ulp off, or Encoding::guard;
/// and value_spread() of both values.
/// Not idempotent: floor a baked ratio once.
/// ratio: >= 0; height: of the texel, as stored
[[nodiscard]] std::uint32_t floor_code(float ratio, float height, TexelType type, const Encoding& encoding);
/// The ratio that the shader will see: floor_code, decoded.
[[nodiscard]] float floor_ratio(float ratio, float height, TexelType type, const Encoding& encoding);

}  // namespace reliefbench
