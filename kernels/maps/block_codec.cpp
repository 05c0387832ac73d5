#include "kernels/maps/block_codec.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <type_traits>

#include "kernels/base/parallel.h"

namespace reliefbench {
namespace {

/// Of types whose channels have blocks of their own, one after the other.
template <BlockBytes (*encode)(const BlockCodes&, BlockRounding)>
void encode_each(std::span<const AskedCodes> channels, std::span<std::uint8_t> block) {
  for (const auto& [codes, rounding] : channels) {
    std::ranges::copy(encode(codes, rounding), block.begin());
    block = block.subspan(sizeof(BlockBytes));
  }
}
template <BlockCodes (*decode)(const BlockBytes&)>
BlockCodes decode_one(std::span<const std::uint8_t> block, std::size_t channel) {
  BlockBytes bytes{};
  std::ranges::copy(block.subspan(channel * bytes.size(), bytes.size()), bytes.begin());
  return decode(bytes);
}

constexpr std::array kCodecs{
    BlockCodec{.type = TexelType::rgtc, .encode = encode_each<encode_rgtc>, .decode = decode_one<decode_rgtc>},
    BlockCodec{.type = TexelType::eac, .encode = encode_each<encode_eac>, .decode = decode_one<decode_eac>},
    BlockCodec{.type = TexelType::bc7, .encode = encode_bc7, .decode = decode_bc7},
    BlockCodec{.type = TexelType::astc, .encode = encode_astc, .decode = decode_astc},
};

constexpr int kBlockSide = 4;

int blocks_along(int side) { return (side + kBlockSide - 1) / kBlockSide; }

/// A level of a block image, and where it begins.
struct BlockLevel {
  int width, height;
  std::size_t first_byte;
};
BlockLevel block_level(const TextureImage& image, int level) {
  std::size_t first = 0;
  for (int l = 0; l < level; ++l)
    first += level_bytes(image.layout, level_side(image.width, l), level_side(image.height, l));
  return {.width = level_side(image.width, level), .height = level_side(image.height, level), .first_byte = first};
}

/// The bytes of a block; Image: const or not.
template <typename Image>
auto block_bytes(Image& image, const BlockLevel& level, int column, int row) {
  const auto index = static_cast<std::size_t>(row) * static_cast<std::size_t>(blocks_along(level.width)) +
                     static_cast<std::size_t>(column);
  const std::size_t size = level_bytes(image.layout, 1, 1);
  using Byte = std::conditional_t<std::is_const_v<Image>, const std::uint8_t, std::uint8_t>;
  return std::span(reinterpret_cast<Byte*>(image.texels.data()) + level.first_byte + index * size, size);
}

/// A level of codes of whole texels.
struct CodeLevel {
  const std::byte* texels;
  int width, height, channels;
  std::size_t code_bytes;
  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(channels) *
           code_bytes;
  }
  [[nodiscard]] BlockCodes block(int column, int row, int channel) const {
    BlockCodes codes{};
    for (int i = 0; i < kBlockSide * kBlockSide; ++i) {
      const auto x = static_cast<std::size_t>(std::min(kBlockSide * column + i % kBlockSide, width - 1));
      const auto y = static_cast<std::size_t>(std::min(kBlockSide * row + i / kBlockSide, height - 1));
      const std::size_t at = (y * static_cast<std::size_t>(width) + x) * static_cast<std::size_t>(channels) +
                             static_cast<std::size_t>(channel);
      std::memcpy(&codes.at(static_cast<std::size_t>(i)), texels + at * code_bytes, code_bytes);
    }
    return codes;
  }
};

}  // namespace

const BlockCodec& find_codec(TexelType type) {
  const auto* const row = std::ranges::find(kCodecs, type, &BlockCodec::type);
  assert(row != kCodecs.end());
  return *row;
}

TextureImage as_blocks(const TextureImage& codes, BlockRounding first, BlockRounding second) {
  const BlockCodec& codec = find_codec(codes.layout.type);
  TextureImage blocks = codes;
  blocks.texels.resize(image_bytes(blocks));
  CodeLevel whole{.texels = codes.texels.data(),
                  .width = codes.width,
                  .height = codes.height,
                  .channels = codes.layout.channels,
                  .code_bytes = static_cast<std::size_t>(codes.layout.bytes() / codes.layout.channels)};
  const auto channels = static_cast<std::size_t>(codes.layout.channels);
  for (int l = 0; l < codes.levels; ++l) {
    const BlockLevel level = block_level(blocks, l);
    whole.width = level.width;
    whole.height = level.height;
    parallel_for(blocks_along(level.height), 0, [&](int row) {
      for (int column = 0; column < blocks_along(level.width); ++column) {
        std::array<AskedCodes, 2> asked{{{.rounding = first}, {.rounding = second}}};
        for (std::size_t channel = 0; channel < channels; ++channel)
          asked.at(channel).codes = whole.block(column, row, static_cast<int>(channel));
        codec.encode(std::span(asked).first(channels), block_bytes(blocks, level, column, row));
      }
    });
    whole.texels += whole.size();
  }
  return blocks;
}

std::vector<float> read_blocks(const TextureImage& image, int channel, int level) {
  const BlockCodec& codec = find_codec(image.layout.type);
  const auto greatest = static_cast<float>(greatest_code(image.layout.type));
  const BlockLevel here = block_level(image, level);
  std::vector<float> values(static_cast<std::size_t>(here.width) * static_cast<std::size_t>(here.height));
  for (int row = 0; row < blocks_along(here.height); ++row)
    for (int column = 0; column < blocks_along(here.width); ++column) {
      const BlockCodes codes = codec.decode(block_bytes(image, here, column, row), static_cast<std::size_t>(channel));
      for (int i = 0; i < kBlockSide * kBlockSide; ++i) {
        const int x = kBlockSide * column + i % kBlockSide;
        const int y = kBlockSide * row + i / kBlockSide;
        if (x >= here.width || y >= here.height) continue;
        values[static_cast<std::size_t>(y) * static_cast<std::size_t>(here.width) + static_cast<std::size_t>(x)] =
            static_cast<float>(codes.at(static_cast<std::size_t>(i))) / greatest;
      }
    }
  return values;
}

Heightfield heights_in_blocks(const Heightfield& heights, TexelType type, BlockRounding rounding) {
  TextureImage codes{.width = heights.width, .height = heights.height, .layout = {.type = type, .channels = 1}};
  const auto code_bytes = static_cast<std::size_t>(codes.layout.bytes());
  codes.texels.resize(heights.texels.size() * code_bytes);
  const auto greatest = static_cast<double>(greatest_code(type));
  const double float_rounding = greatest * (1e-5 / 255);
  std::byte* at = codes.texels.data();
  for (const float height : heights.texels) {
    const double exact = greatest * static_cast<double>(height);
    const auto code = static_cast<std::uint16_t>(rounding == BlockRounding::above   ? std::ceil(exact - float_rounding)
                                                 : rounding == BlockRounding::below ? std::floor(exact + float_rounding)
                                                                                    : std::round(exact));
    std::memcpy(at, &code, code_bytes);
    at += code_bytes;
  }
  Heightfield result = heights;
  result.texels = read_blocks(as_blocks(codes, rounding, rounding), 0, 0);
  return result;
}

}  // namespace reliefbench
