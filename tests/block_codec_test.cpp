#include "kernels/maps/block_codec.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>

#include "kernels/maps/map_texture.h"

namespace reliefbench {
namespace {

rc::Gen<BlockCodes> any_codes() {
  return rc::gen::exec([] {
    const int contrast = 1 << *rc::gen::inRange(0, 9);
    const int low = *rc::gen::inRange(0, 257 - contrast);
    const bool has_ends = *rc::gen::arbitrary<bool>();
    BlockCodes codes{};
    for (std::uint8_t& code : codes) {
      code = static_cast<std::uint8_t>(low + *rc::gen::inRange(0, contrast));
      if (has_ends && *rc::gen::inRange(0, 4) == 0) code = *rc::gen::arbitrary<bool>() ? 255 : 0;
    }
    return codes;
  });
}

double cost(const BlockCodes& codes, const BlockCodes& had, BlockRounding rounding) {
  double sum = 0;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const double code = codes.at(i);
    const double own = had.at(i);
    if (rounding == BlockRounding::nearest) {
      sum += (code - own) * (code - own);
    } else if (rounding == BlockRounding::below) {
      sum += own > code ? std::numeric_limits<double>::infinity() : (code + 1) / (own + 1) - 1;
    } else {
      sum += own < code ? std::numeric_limits<double>::infinity() : (256 - code) / (256 - own) - 1;
    }
  }
  return sum;
}

/// The least cost of all blocks whose values are whole.
double least_cost(const BlockCodes& codes, BlockRounding rounding) {
  double least = std::numeric_limits<double>::infinity();
  for (const int intervals : {7, 5})
    for (int step = intervals == 7 ? 1 : 0; intervals * step <= 255; ++step)
      for (int first = 0; first + intervals * step <= 255; ++first) {
        std::vector<int> values;
        for (int i = 0; i <= intervals; ++i) values.push_back(first + i * step);
        if (intervals == 5) values.insert(values.end(), {0, 255});
        double sum = 0;
        for (std::size_t i = 0; i < codes.size() && sum < least; ++i) {
          double best = std::numeric_limits<double>::infinity();
          for (const int value : values) {
            BlockCodes one{};
            BlockCodes other{};
            one[0] = codes.at(i);
            other[0] = static_cast<std::uint8_t>(value);
            if (rounding == BlockRounding::above) std::fill(other.begin() + 1, other.end(), std::uint8_t{0});
            best = std::min(best, cost(one, other, rounding));
          }
          sum += best;
        }
        least = std::min(least, sum);
      }
  return least;
}

TEST(BlockCodec, decodes_as_specified) {
  // Indices 0 to 7, twice, 3 bits each from the lowest on.
  const BlockBytes falling{255, 3, 0x88, 0xC6, 0xFA, 0x88, 0xC6, 0xFA};
  EXPECT_THAT(decode_block(falling),
              ::testing::ElementsAre(255, 3, 219, 183, 147, 111, 75, 39, 255, 3, 219, 183, 147, 111, 75, 39));
  const BlockBytes rising{10, 20, 0x88, 0xC6, 0xFA, 0x88, 0xC6, 0xFA};
  EXPECT_THAT(decode_block(rising),
              ::testing::ElementsAre(10, 20, 12, 14, 16, 18, 0, 255, 10, 20, 12, 14, 16, 18, 0, 255));
}

RC_GTEST_PROP(BlockCodec, has_whole_codes_on_the_asked_side, ()) {
  const BlockCodes codes = *any_codes();
  for (const BlockRounding rounding : {BlockRounding::nearest, BlockRounding::below, BlockRounding::above}) {
    const BlockBytes block = encode_block(codes, rounding);
    // Then all between the endpoints are whole, and no decoder rounds them.
    const bool is_whole = block[0] > block[1] ? (block[0] - block[1]) % 7 == 0 : (block[1] - block[0]) % 5 == 0;
    RC_ASSERT(is_whole);
    const BlockCodes had = decode_block(block);
    RC_ASSERT(cost(codes, had, rounding) < std::numeric_limits<double>::infinity());
    RC_ASSERT(decode_block(encode_block(had, rounding)) == had);
    RC_ASSERT(decode_block(encode_block(had, BlockRounding::nearest)) == had);
  }
}

TEST(BlockCodec, is_about_the_best_of_all_blocks) {
  double own = 0;
  double best = 0;
  rc::Random random(3);
  for (int i = 0; i < 12; ++i) {
    const BlockCodes codes = any_codes()(random.split(), 100).value();
    for (const BlockRounding rounding : {BlockRounding::nearest, BlockRounding::below}) {
      const double least = least_cost(codes, rounding);
      const double cost_here = cost(codes, decode_block(encode_block(codes, rounding)), rounding);
      EXPECT_GE(cost_here, least * (1 - 1e-12));
      EXPECT_LE(cost_here, 1.5 * least + 1e-9);
      own += cost_here;
      best += least;
    }
  }
  EXPECT_LE(own, 1.05 * best);
}

TEST(BlockCodec, an_image_may_end_within_a_block) {
  for (const int width : {1, 3, 4, 9})
    for (const int height : {2, 5, 8}) {
      TextureImage image{
          .width = width, .height = height, .layout = {.type = TexelType::unorm8, .channels = 2}, .levels = 2};
      image.texels.resize(image_bytes(image));
      for (std::size_t i = 0; i < image.texels.size(); ++i)
        image.texels[i] = static_cast<std::byte>(i % 2 == 0 ? 7 : 9);
      const TextureImage blocks = as_blocks(image, BlockRounding::below);
      const auto bytes = [](int w, int h) { return static_cast<std::size_t>(16 * ((w + 3) / 4) * ((h + 3) / 4)); };
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
  const Heightfield nearest = quantise_heights(heights, TexelType::rgtc);
  RC_ASSERT(quantise_heights(nearest, TexelType::rgtc).texels == nearest.texels);
  RC_ASSERT(read_channel(pack_heights(nearest, find_format("bc4")).relief, 0) == nearest.texels);
  const Heightfield above = heights_in_blocks(heights, BlockRounding::above);
  for (std::size_t i = 0; i < heights.texels.size(); ++i) RC_ASSERT(above.texels[i] >= heights.texels[i] - 1e-7F);
}

}  // namespace
}  // namespace reliefbench
