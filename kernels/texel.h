#pragma once
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/heightfield.h"

namespace reliefbench {

enum class TexelType { unorm8, unorm16, float16, float32 };

/// A texture format, one row. Height is stored in the first channel, the cone ratio in the second.
struct Format {
  std::string_view id;  ///< r8, r16, r16f, r32f, rg8, rg16, rg16f, rg32f
  TexelType type;
  int channels;
  [[nodiscard]] int bytes_per_texel() const;
};
[[nodiscard]] std::span<const Format> formats();
[[nodiscard]] const Format& find_format(std::string_view id);  ///< throws: Error(bad_input) listing the choices

/// How a cone ratio in [0,1] becomes a stored value. `shader_value` is the ENCODING specialization constant.
struct Encoding {
  std::string_view id;  ///< ratio | sqrt
  int shader_value;
  std::string_view source;
  float (*decode)(float stored);  ///< the shader's arithmetic, in float
};
[[nodiscard]] std::span<const Encoding> encodings();
[[nodiscard]] const Encoding& find_encoding(std::string_view id);

/// Heights as the GPU will read them back: rounded to the nearest code of `type`, decoded. Cones are
/// built from these, never from the unquantised heights.
[[nodiscard]] Heightfield quantise_heights(const Heightfield& heights, TexelType type);

/// The largest value storable in `type` whose decoded ratio, with one ulp of guard, is <= ratio; 0 if none is.
/// The guard is for samplers whose unorm conversion is an ulp off. Not idempotent: floor a baked ratio once.
/// ratio in [0,1]; returns the decoded ratio that the shader will see.
[[nodiscard]] float floor_ratio(float ratio, TexelType type, const Encoding& encoding);

/// A texture ready for upload.
struct TextureImage {
  int width = 0;
  int height = 0;
  const Format* format = nullptr;
  std::vector<std::byte> texels;  ///< tightly packed rows
};

/// Packs quantised heights and (for two channels) ratios; `ratios` may be empty: the channel is then 0.
/// heights: already quantised by quantise_heights for format.type
/// ratios: as baked; they are floored here (floor_ratio)
[[nodiscard]] TextureImage pack_texture(const Heightfield& heights, std::span<const float> ratios, const Format& format,
                                        const Encoding& encoding);

/// Decodes a packed texture again (tests, --verify): heights and ratios as the shader sees them at texel centres.
struct UnpackedTexture {
  Heightfield heights;
  std::vector<float> ratios;  ///< empty for one-channel formats
};
[[nodiscard]] UnpackedTexture unpack_texture(const TextureImage& image, const Encoding& encoding);

}  // namespace reliefbench
