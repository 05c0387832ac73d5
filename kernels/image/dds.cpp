#include "kernels/image/dds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstdint>

namespace reliefbench {
namespace {

static_assert(std::endian::native == std::endian::little);  // as the file is

/// DXGI_FORMAT of a texel layout.
struct DxgiRow {
  TexelLayout layout;
  std::uint32_t dxgi_format = 0;
};
constexpr std::array kDxgiFormats{
    DxgiRow{{TexelType::unorm8, 1}, 61},  DxgiRow{{TexelType::unorm8, 2}, 49},  DxgiRow{{TexelType::unorm8, 4}, 28},
    DxgiRow{{TexelType::unorm16, 1}, 56}, DxgiRow{{TexelType::unorm16, 2}, 35}, DxgiRow{{TexelType::unorm16, 4}, 11},
    DxgiRow{{TexelType::float16, 1}, 54}, DxgiRow{{TexelType::float16, 2}, 34}, DxgiRow{{TexelType::float16, 4}, 10},
    DxgiRow{{TexelType::float32, 1}, 41}, DxgiRow{{TexelType::float32, 2}, 16}, DxgiRow{{TexelType::float32, 4}, 2},
    DxgiRow{{TexelType::rgtc, 1}, 80},    DxgiRow{{TexelType::rgtc, 2}, 83},    DxgiRow{{TexelType::bc7, 2}, 98}};

constexpr std::uint32_t kMagic = 0x20534444;         // "DDS "
constexpr std::uint32_t kFourCc = 0x30315844;        // "DX10"
constexpr std::uint32_t kHasFlags = 0x0002'1007;     // caps, height, width, pixel format, mip count
constexpr std::uint32_t kHasPitch = 0x8;             // bytes a row
constexpr std::uint32_t kHasLinearSize = 0x8'0000;   // bytes of the first level instead, where it is of blocks
constexpr std::uint32_t kTextureCaps = 0x0040'1008;  // complex, texture, mipmaps

}  // namespace

std::string encode_dds(const TextureImage& image) {
  const auto* const row = std::ranges::find(kDxgiFormats, image.layout, &DxgiRow::layout);
  assert(row != kDxgiFormats.end());
  const auto width = static_cast<std::uint32_t>(image.width);
  const bool has_blocks = is_of_blocks(image.layout.type);
  const auto pitch = static_cast<std::uint32_t>(level_bytes(image.layout, image.width, has_blocks ? image.height : 1));
  const std::uint32_t flags = kHasFlags | (has_blocks ? kHasLinearSize : kHasPitch);
  // Magic; header: its size, flags, height, width, pitch, depth, levels, 11 reserved, pixel format of 8, caps of 4, 1
  // reserved; Direct3D 10's: format, dimension (3 = 2D), misc, array size, misc 2.
  std::array<std::uint32_t, 1 + 31 + 5> words{};
  const std::array<std::uint32_t, 8> first = {kMagic, 124,   flags, static_cast<std::uint32_t>(image.height),
                                              width,  pitch, 1,     static_cast<std::uint32_t>(image.levels)};
  std::ranges::copy(first, words.begin());
  words[19] = 32;  // size of the pixel format
  words[20] = 4;   // it is a FourCC
  words[21] = kFourCc;
  words[27] = kTextureCaps;
  words[32] = row->dxgi_format;
  words[33] = 3;
  words[35] = 1;
  std::string bytes(reinterpret_cast<const char*>(words.data()), sizeof(words));
  bytes.append(reinterpret_cast<const char*>(image.texels.data()), image.texels.size());
  return bytes;
}

}  // namespace reliefbench
