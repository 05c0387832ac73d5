#include "kernels/maps/block_codec.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>

#include "kernels/maps/map_texture.h"

namespace reliefbench {
namespace {

constexpr double kImpossible = std::numeric_limits<double>::infinity();
constexpr BlockRounding kRoundings[] = {BlockRounding::nearest, BlockRounding::below, BlockRounding::above};

rc::Gen<BlockCodes> any_codes(TexelType type) {
  return rc::gen::exec([type] {
    const auto greatest = static_cast<int>(greatest_code(type));
    const int contrast = 1 << *rc::gen::inRange(0, type == TexelType::rgtc ? 9 : 12);
    const int low = *rc::gen::inRange(0, greatest + 2 - contrast);
    const bool has_ends = *rc::gen::arbitrary<bool>();
    BlockCodes codes{};
    for (std::uint16_t& code : codes) {
      code = static_cast<std::uint16_t>(low + *rc::gen::inRange(0, contrast));
      if (has_ends && *rc::gen::inRange(0, 4) == 0)
        code = static_cast<std::uint16_t>(*rc::gen::arbitrary<bool>() ? greatest : 0);
    }
    return codes;
  });
}

/// A channel in a block of its own, read again.
BlockCodes had_of(const BlockCodec& codec, const BlockCodes& codes, BlockRounding rounding) {
  const AskedCodes asked{.codes = codes, .rounding = rounding};
  BlockBytes block{};
  codec.encode({&asked, 1}, block);
  return codec.decode(block, 0);
}

/// What one texel costs.
double cost(double code, double own, BlockRounding rounding, double greatest) {
  if (rounding == BlockRounding::nearest) return (code - own) * (code - own);
  if (rounding == BlockRounding::below) return own > code ? kImpossible : (code + 1) / (own + 1) - 1;
  return own < code ? kImpossible : (greatest + 1 - code) / (greatest + 1 - own) - 1;
}

double cost(const BlockCodes& codes, const BlockCodes& had, BlockRounding rounding, double greatest) {
  double sum = 0;
  for (std::size_t i = 0; i < codes.size(); ++i) sum += cost(codes.at(i), had.at(i), rounding, greatest);
  return sum;
}

/// The values of all blocks of BC4 whose values are whole.
std::vector<std::vector<int>> whole_palettes_of_bc4() {
  std::vector<std::vector<int>> palettes;
  for (const int intervals : {7, 5})
    for (int step = intervals == 7 ? 1 : 0; intervals * step <= 255; ++step)
      for (int first = 0; first + intervals * step <= 255; ++first) {
        std::vector<int>& values = palettes.emplace_back();
        for (int i = 0; i <= intervals; ++i) values.push_back(first + i * step);
        if (intervals == 5) values.insert(values.end(), {0, 255});
      }
  return palettes;
}

/// The values of all blocks of EAC R11, whose texels have the indices 0 to 7, twice.
std::vector<std::vector<int>> palettes_of_eac() {
  std::vector<std::vector<int>> palettes;
  palettes.reserve(1U << 16U);
  for (unsigned head = 0; head < 1U << 16U; ++head) {
    const auto base = static_cast<std::uint8_t>(head >> 8U);
    const BlockCodes columns = decode_eac({base, static_cast<std::uint8_t>(head), 0x05, 0x39, 0x77, 0x05, 0x39, 0x77});
    std::vector<int>& values = palettes.emplace_back();
    for (std::size_t i = 0; i < 8; ++i) values.push_back(columns.at(4 * (i % 4) + i / 4));
  }
  return palettes;
}

/// The least cost of all palettes.
double least_cost(const std::vector<std::vector<int>>& palettes, const BlockCodes& codes, BlockRounding rounding,
                  double greatest) {
  double least = kImpossible;
  for (const std::vector<int>& values : palettes) {
    double sum = 0;
    for (std::size_t i = 0; i < codes.size() && sum < least; ++i) {
      double best = kImpossible;
      for (const int value : values) best = std::min(best, cost(codes.at(i), value, rounding, greatest));
      sum += best;
    }
    least = std::min(least, sum);
  }
  return least;
}

TEST(BlockCodec, bc4_decodes_as_specified) {
  // Indices 0 to 7, twice, 3 bits each from the lowest on.
  const BlockBytes falling{255, 3, 0x88, 0xC6, 0xFA, 0x88, 0xC6, 0xFA};
  EXPECT_THAT(decode_rgtc(falling),
              ::testing::ElementsAre(255, 3, 219, 183, 147, 111, 75, 39, 255, 3, 219, 183, 147, 111, 75, 39));
  const BlockBytes rising{10, 20, 0x88, 0xC6, 0xFA, 0x88, 0xC6, 0xFA};
  EXPECT_THAT(decode_rgtc(rising),
              ::testing::ElementsAre(10, 20, 12, 14, 16, 18, 0, 255, 10, 20, 12, 14, 16, 18, 0, 255));
}

// The specification's own examples: of base 103 and table 13, the modifier -10 is 668 if it is doubled, 818 if the
// multiplier is 0.
TEST(BlockCodec, eac_decodes_as_specified) {
  // Indices 0 to 7, twice, 3 bits each from the highest on, column by column.
  const BlockBytes doubled{103, 0x2D, 0x05, 0x39, 0x77, 0x05, 0x39, 0x77};
  EXPECT_THAT(decode_eac(doubled),
              ::testing::ElementsAre(812, 828, 812, 828, 796, 844, 796, 844, 780, 860, 780, 860, 668, 972, 668, 972));
  const BlockBytes fine{103, 0x0D, 0x05, 0x39, 0x77, 0x05, 0x39, 0x77};
  EXPECT_THAT(decode_eac(fine),
              ::testing::ElementsAre(827, 828, 827, 828, 826, 829, 826, 829, 825, 830, 825, 830, 818, 837, 818, 837));
  // Base 255, multiplier 1, table 15, all indices 0, then 7; and what lies under 0.
  EXPECT_THAT(decode_eac({255, 0x1F, 0, 0, 0, 0, 0, 0}), ::testing::Each(2044 - 24));
  EXPECT_THAT(decode_eac({255, 0x1F, 255, 255, 255, 255, 255, 255}), ::testing::Each(2047));
  EXPECT_THAT(decode_eac({0, 0xF0, 0x6D, 0xB6, 0xDB, 0x6D, 0xB6, 0xDB}), ::testing::Each(0));
}

RC_GTEST_PROP(BlockCodec, has_codes_on_the_asked_side, ()) {
  for (const TexelType type : {TexelType::rgtc, TexelType::eac}) {
    const BlockCodec& codec = find_codec(type);
    const BlockCodes codes = *any_codes(type);
    for (const BlockRounding rounding : kRoundings) {
      // Then all between the endpoints are whole, and no decoder rounds them.
      const BlockBytes block = type == TexelType::rgtc ? encode_rgtc(codes, rounding) : BlockBytes{};
      RC_ASSERT((block[0] > block[1] ? (block[0] - block[1]) % 7 : (block[1] - block[0]) % 5) == 0);
      const BlockCodes had = had_of(codec, codes, rounding);
      RC_ASSERT(cost(codes, had, rounding, greatest_code(type)) < kImpossible);
      for (const BlockRounding again : kRoundings) RC_ASSERT(had_of(codec, had, again) == had);
    }
  }
}

RC_GTEST_PROP(BlockCodec, eac_keeps_what_a_block_can_have, ()) {
  BlockBytes block{};
  for (std::uint8_t& byte : block) byte = *rc::gen::arbitrary<std::uint8_t>();
  for (const BlockRounding rounding : kRoundings)
    RC_ASSERT(decode_eac(encode_eac(decode_eac(block), rounding)) == decode_eac(block));
}

TEST(BlockCodec, is_about_the_best_of_all_blocks) {
  rc::Random random(3);
  for (const TexelType type : {TexelType::rgtc, TexelType::eac}) {
    const BlockCodec& codec = find_codec(type);
    const auto palettes = type == TexelType::rgtc ? whole_palettes_of_bc4() : palettes_of_eac();
    const double greatest = greatest_code(type);
    double own = 0;
    double best = 0;
    for (int i = 0; i < 12; ++i) {
      const BlockCodes codes = any_codes(type)(random.split(), 100).value();
      for (const BlockRounding rounding : kRoundings) {
        const double least = least_cost(palettes, codes, rounding, greatest);
        const double cost_here = cost(codes, had_of(codec, codes, rounding), rounding, greatest);
        EXPECT_GE(cost_here, least * (1 - 1e-12));
        EXPECT_LE(cost_here, 1.5 * least + 1e-9);
        own += cost_here;
        best += least;
      }
    }
    EXPECT_LE(own, 1.05 * best) << texel_type_id(type);
  }
}

TEST(BlockCodec, an_image_may_end_within_a_block) {
  for (const int width : {1, 3, 4, 9})
    for (const int height : {2, 5, 8}) {
      TextureImage image{
          .width = width, .height = height, .layout = {.type = TexelType::unorm8, .channels = 2}, .levels = 2};
      image.texels.resize(image_bytes(image));
      for (std::size_t i = 0; i < image.texels.size(); ++i)
        image.texels[i] = static_cast<std::byte>(i % 2 == 0 ? 7 : 9);
      TextureImage codes = image;
      codes.layout.type = TexelType::rgtc;
      const TextureImage blocks = as_blocks(codes, BlockRounding::nearest, BlockRounding::below);
      const auto bytes = [](int w, int h) {
        return 16 * static_cast<std::size_t>((w + 3) / 4) * static_cast<std::size_t>((h + 3) / 4);
      };
      EXPECT_EQ(blocks.texels.size(), bytes(width, height) + bytes(level_side(width, 1), level_side(height, 1)));
      for (const int level : {0, 1})
        for (const int channel : {0, 1})
          EXPECT_EQ(read_blocks(blocks, channel, level), read_channel(image, channel, level));
    }
}

RC_GTEST_PROP(BlockCodec, heights_stay_as_they_are_in_blocks, ()) {
  const int width = *rc::gen::inRange(1, 10);
  const int height = *rc::gen::inRange(1, 10);
  Heightfield heights{.width = width, .height = height, .texels = {}};
  const int contrast = *rc::gen::inRange(1, 1000);
  for (int i = 0; i < width * height; ++i)
    heights.texels.push_back(static_cast<float>(*rc::gen::inRange(0, contrast + 1)) / 1000);
  for (const std::string_view id : {"bc4", "eac_r11"}) {
    const Format& format = find_format(id);
    const Heightfield nearest = quantise_heights(heights, format.type);
    RC_ASSERT(quantise_heights(nearest, format.type).texels == nearest.texels);
    RC_ASSERT(read_channel(pack_heights(nearest, format).relief, 0) == nearest.texels);
    const Heightfield above = heights_in_blocks(heights, format.type, BlockRounding::above);
    RC_ASSERT(heights_in_blocks(above, format.type, BlockRounding::above).texels == above.texels);
    for (std::size_t i = 0; i < heights.texels.size(); ++i) RC_ASSERT(above.texels[i] >= heights.texels[i] - 1e-7F);
  }
}

}  // namespace
}  // namespace reliefbench
