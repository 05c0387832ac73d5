#include "kernels/texel.h"

#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "kernels/error.h"
#include "kernels/parallel.h"

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
};

constexpr std::array kEncodings{
    Encoding{.id = "ratio", .shader_value = 0, .source = "[DUM06]", .decode = [](float stored) { return stored; }},
    Encoding{
        .id = "sqrt", .shader_value = 1, .source = "[PO07]", .decode = [](float stored) { return stored * stored; }},
};

template <typename Rows>
const typename Rows::value_type& find_row(const Rows& rows, std::string_view id, std::string_view kind) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& candidate) { return candidate.id == id; });
  if (row != rows.end()) return *row;
  std::string choices;
  for (const auto& candidate : rows) choices += (choices.empty() ? "" : ", ") + std::string(candidate.id);
  fail_input("unknown {} '{}'; the choices are {}", kind, id, choices);
}

int bytes_per_channel(TexelType type) {
  switch (type) {
    case TexelType::unorm8:
      return 1;
    case TexelType::unorm16:
    case TexelType::float16:
      return 2;
    case TexelType::float32:
      return 4;
  }
  return 0;
}

/// A code is the bits as stored. For values in [0, 1] all four types are ordered as their codes are.
float value_of(std::uint32_t code, TexelType type) {
  switch (type) {
    case TexelType::unorm8:
      return static_cast<float>(code) / 255.0F;
    case TexelType::unorm16:
      return static_cast<float>(code) / 65535.0F;
    case TexelType::float16:
      return half(half::FromBits, static_cast<std::uint16_t>(code));
    case TexelType::float32:
      return std::bit_cast<float>(code);
  }
  return 0;
}

/// The code of the value nearest to `value` in [0, 1]; halves: ties to even.
std::uint32_t nearest_code(float value, TexelType type) {
  switch (type) {
    case TexelType::unorm8:
      return static_cast<std::uint32_t>(std::lround(double{value} * 255.0));
    case TexelType::unorm16:
      return static_cast<std::uint32_t>(std::lround(double{value} * 65535.0));
    case TexelType::float16:
      return half(value).bits();
    case TexelType::float32:
      return std::bit_cast<std::uint32_t>(value);
  }
  return 0;
}

/// The largest code whose decoded ratio is strictly below `ratio` (between floats that is one ulp of guard), or 0.
std::uint32_t floor_code(float ratio, TexelType type, const Encoding& encoding) {
  std::uint32_t fits = 0;
  std::uint32_t too_wide = nearest_code(1.0F, type) + 1;
  while (too_wide - fits > 1) {
    const std::uint32_t middle = fits + (too_wide - fits) / 2;
    (encoding.decode(value_of(middle, type)) < ratio ? fits : too_wide) = middle;
  }
  return fits;
}

// The first bytes of a little-endian code are its low ones, and GPUs read texels in the host's order.
static_assert(std::endian::native == std::endian::little);

void write_code(TextureImage& image, std::size_t texel, int channel, std::uint32_t code) {
  const auto size = static_cast<std::size_t>(bytes_per_channel(image.format->type));
  const std::size_t index =
      texel * static_cast<std::size_t>(image.format->channels) + static_cast<std::size_t>(channel);
  std::memcpy(image.texels.data() + index * size, &code, size);
}

float read_value(const TextureImage& image, std::size_t texel, int channel) {
  const auto size = static_cast<std::size_t>(bytes_per_channel(image.format->type));
  const std::size_t index =
      texel * static_cast<std::size_t>(image.format->channels) + static_cast<std::size_t>(channel);
  std::uint32_t code = 0;
  std::memcpy(&code, image.texels.data() + index * size, size);
  return value_of(code, image.format->type);
}

}  // namespace

int Format::bytes_per_texel() const { return channels * bytes_per_channel(type); }

std::span<const Format> formats() { return kFormats; }
const Format& find_format(std::string_view id) { return find_row(formats(), id, "texture format"); }

std::span<const Encoding> encodings() { return kEncodings; }
const Encoding& find_encoding(std::string_view id) { return find_row(encodings(), id, "cone encoding"); }

Heightfield quantise_heights(const Heightfield& heights, TexelType type) {
  Heightfield quantised = heights;
  for (float& texel : quantised.texels) texel = value_of(nearest_code(texel, type), type);
  return quantised;
}

float floor_ratio(float ratio, TexelType type, const Encoding& encoding) {
  return encoding.decode(value_of(floor_code(ratio, type, encoding), type));
}

TextureImage pack_texture(const Heightfield& heights, std::span<const float> ratios, const Format& format,
                          const Encoding& encoding) {
  assert(ratios.empty() || ratios.size() == heights.texels.size());
  const auto row_texels = static_cast<std::size_t>(heights.width);
  TextureImage image{.width = heights.width, .height = heights.height, .format = &format, .texels = {}};
  image.texels.resize(heights.texels.size() * static_cast<std::size_t>(format.bytes_per_texel()));
  parallel_for(heights.height, 0, [&](int y) {
    const std::size_t begin = static_cast<std::size_t>(y) * row_texels;
    for (std::size_t i = begin; i < begin + row_texels; ++i) {
      write_code(image, i, 0, nearest_code(heights.texels[i], format.type));
      if (format.channels == 2 && !ratios.empty())
        write_code(image, i, 1, floor_code(ratios[i], format.type, encoding));
    }
  });
  return image;
}

UnpackedTexture unpack_texture(const TextureImage& image, const Encoding& encoding) {
  UnpackedTexture unpacked;
  unpacked.heights = {.width = image.width, .height = image.height, .texels = {}};
  const std::size_t count = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  for (std::size_t i = 0; i < count; ++i) {
    unpacked.heights.texels.push_back(read_value(image, i, 0));
    if (image.format->channels == 2) unpacked.ratios.push_back(encoding.decode(read_value(image, i, 1)));
  }
  return unpacked;
}

}  // namespace reliefbench
