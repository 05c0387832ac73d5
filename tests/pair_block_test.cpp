#include "kernels/maps/pair_block.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

#include "kernels/maps/map_texture.h"

namespace reliefbench {
namespace {

using PairBytes = std::array<std::uint8_t, 16>;

constexpr BlockRounding kNearest = BlockRounding::nearest;
constexpr BlockRounding kBelow = BlockRounding::below;

PairBytes encoded(const BlockCodec& codec, const AskedCodes& first, const AskedCodes& second) {
  PairBytes block{};
  codec.encode(std::array{first, second}, block);
  return block;
}

rc::Gen<BlockCodes> any_codes(int greatest) {
  return rc::gen::exec([greatest] {
    const int contrast = std::min(1 << *rc::gen::inRange(0, 17), greatest + 1);
    const int low = *rc::gen::inRange(0, greatest + 2 - contrast);
    const bool has_ends = *rc::gen::inRange(0, 4) == 0;
    const bool is_ramp = *rc::gen::inRange(0, 4) == 0;
    BlockCodes codes{};
    for (std::size_t i = 0; i < codes.size(); ++i) {
      const int over = is_ramp ? contrast * static_cast<int>(i) / 16 : *rc::gen::inRange(0, contrast);
      codes.at(i) = static_cast<std::uint16_t>(low + over);
      if (has_ends && *rc::gen::inRange(0, 4) == 0)
        codes.at(i) = static_cast<std::uint16_t>(*rc::gen::arbitrary<bool>() ? greatest : 0);
    }
    return codes;
  });
}

/// The specification's own way: fields one after the other, in a text of 128 digits whose first one is bit 0.
class SlowBc7 {
 public:
  explicit SlowBc7(const PairBytes& block) {
    for (const std::uint8_t byte : block)
      for (int i = 0; i < 8; ++i) digits_ += (byte >> i & 1) != 0 ? '1' : '0';
  }

  BlockCodes channel(int wanted) {
    const int mode = static_cast<int>(digits_.find('1'));
    at_ = static_cast<std::size_t>(mode) + 1;
    const int rotation = mode < 6 ? field(2) : 0;
    const bool index_selection = mode == 4 && field(1) == 1;
    const int color_bits = mode == 4 ? 5 : 7;
    const int alpha_bits = mode == 4 ? 6 : (mode == 5 ? 8 : 7);
    int ends[4][2];
    for (int c = 0; c < 4; ++c)
      for (int& end : ends[c]) end = field(c < 3 ? color_bits : alpha_bits);
    if (mode == 6) {
      for (int e = 0; e < 2; ++e) {
        const int p = field(1);
        for (auto& channel : ends) channel[e] = 2 * channel[e] + p;
      }
    } else {
      for (int c = 0; c < 4; ++c)
        for (int& end : ends[c]) {
          const int bits = c < 3 ? color_bits : alpha_bits;
          end = end << (8 - bits);
          end = end | end >> bits;
        }
    }
    const std::vector<int> primary = indices(mode == 6 ? 4 : 2);
    const std::vector<int> secondary = mode == 6 ? primary : indices(mode == 4 ? 3 : 2);
    const int primary_bits = mode == 6 ? 4 : 2;
    const int secondary_bits = mode == 6 ? 4 : (mode == 4 ? 3 : 2);
    BlockCodes codes{};
    for (std::size_t i = 0; i < 16; ++i) {
      int color[4];
      for (int c = 0; c < 4; ++c) {
        const bool is_primary = (c < 3) != index_selection;
        color[c] = interpolate(ends[c][0], ends[c][1], is_primary ? primary[i] : secondary[i],
                               is_primary ? primary_bits : secondary_bits);
      }
      if (rotation > 0) std::swap(color[rotation - 1], color[3]);
      codes.at(i) = static_cast<std::uint16_t>(color[wanted]);
    }
    return codes;
  }

 private:
  int field(int bits) {
    int value = 0;
    for (int i = 0; i < bits; ++i) value += (digits_.at(at_++) - '0') << i;
    return value;
  }
  std::vector<int> indices(int bits) {
    std::vector<int> list{field(bits - 1)};
    while (list.size() < 16) list.push_back(field(bits));
    return list;
  }
  static int interpolate(int low, int high, int index, int bits) {
    constexpr int kWeights2[] = {0, 21, 43, 64};
    constexpr int kWeights3[] = {0, 9, 18, 27, 37, 46, 55, 64};
    constexpr int kWeights4[] = {0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64};
    const int weight = bits == 2 ? kWeights2[index] : (bits == 3 ? kWeights3[index] : kWeights4[index]);
    return ((64 - weight) * low + weight * high + 32) >> 6;
  }

  std::string digits_;
  std::size_t at_ = 0;
};

RC_GTEST_PROP(PairBlock, bc7_decodes_as_specified, ()) {
  PairBytes block{};
  for (std::uint8_t& byte : block) byte = *rc::gen::arbitrary<std::uint8_t>();
  const unsigned mode = *rc::gen::inRange(4U, 7U);
  block[0] = static_cast<std::uint8_t>((block[0] << (mode + 1) | 1U << mode) & 255U);
  for (const int channel : {0, 1})
    RC_ASSERT(decode_bc7(block, static_cast<std::size_t>(channel)) == SlowBc7(block).channel(channel));
}

TEST(PairBlock, other_modes_of_bc7_are_none_of_ours) {
  for (const auto first :
       {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{4}, std::uint8_t{8}, std::uint8_t{128}, std::uint8_t{0}})
    EXPECT_THAT(decode_bc7(PairBytes{first, 255, 255, 255}, 0), ::testing::Each(0));
}

/// Heights are decoded before ratios are known: whatever those are, a block of the same heights has them.
RC_GTEST_PROP(PairBlock, keeps_the_first_channel_and_no_code_above_the_second, ()) {
  for (const TexelType type : {TexelType::bc7}) {
    const BlockCodec& codec = find_codec(type);
    const auto greatest = static_cast<int>(greatest_code(type));
    const BlockCodes asked = *any_codes(greatest);
    for (const BlockRounding rounding : {kNearest, kBelow, BlockRounding::above}) {
      const PairBytes alone = encoded(codec, {asked, rounding}, {{}, kBelow});
      const BlockCodes first = codec.decode(alone, 0);
      RC_ASSERT(codec.decode(alone, 1) == BlockCodes{});
      for (std::size_t i = 0; i < first.size(); ++i) {
        RC_ASSERT(rounding != kBelow || first.at(i) <= asked.at(i));
        RC_ASSERT(rounding != BlockRounding::above || first.at(i) >= asked.at(i));
      }
      const BlockCodes second = *any_codes(greatest);
      const PairBytes both = encoded(codec, {first, rounding}, {second, kBelow});
      RC_ASSERT(codec.decode(both, 0) == first);
      const BlockCodes had = codec.decode(both, 1);
      for (std::size_t i = 0; i < had.size(); ++i) RC_ASSERT(had.at(i) <= second.at(i));
    }
  }
}

TEST(PairBlock, flat_heights_are_exact) {
  const BlockCodec& codec = find_codec(TexelType::bc7);
  for (int height = 0; height < 256; ++height)
    for (const int ratio : {0, 1, 77, 254, 255}) {
      AskedCodes first;
      AskedCodes second{.rounding = kBelow};
      first.codes.fill(static_cast<std::uint16_t>(height));
      second.codes.fill(static_cast<std::uint16_t>(ratio));
      const PairBytes block = encoded(codec, first, second);
      EXPECT_THAT(codec.decode(block, 0), ::testing::Each(height));
      EXPECT_THAT(codec.decode(block, 1),
                  ::testing::Each(::testing::AllOf(::testing::Le(ratio), ::testing::Ge(ratio - 1))));
    }
}

/// The least sum of squares over all pairs of endpoints of so many bits, repeated to 8 or with a last bit of 0.
double least_squares(const BlockCodes& codes, int bits, bool is_even, const std::vector<int>& weights) {
  const auto end = [&](int i) { return is_even ? 2 * i : i << (8 - bits) | i >> (2 * bits - 8); };
  double least = std::numeric_limits<double>::infinity();
  for (int low = 0; low < 1 << bits; ++low)
    for (int high = low; high < 1 << bits; ++high) {
      double sum = 0;
      for (std::size_t i = 0; i < codes.size() && sum < least; ++i) {
        double best = 1e9;
        for (const int weight : weights) {
          const double off = (((64 - weight) * end(low) + weight * end(high) + 32) >> 6) - codes.at(i);
          best = std::min(best, off * off);
        }
        sum += best;
      }
      least = std::min(least, sum);
    }
  return least;
}

TEST(PairBlock, bc7_is_about_the_best_of_its_modes) {
  const std::vector<int> two{0, 21, 43, 64};
  const std::vector<int> three{0, 9, 18, 27, 37, 46, 55, 64};
  const std::vector<int> four{0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64};
  rc::Random random(4);
  double own = 0;
  double best = 0;
  for (int i = 0; i < 24; ++i) {
    const BlockCodes codes = any_codes(255)(random.split(), 100).value();
    const BlockCodes had = decode_bc7(encoded(find_codec(TexelType::bc7), {codes, kNearest}, {{}, kBelow}), 0);
    double here = 0;
    for (std::size_t k = 0; k < codes.size(); ++k) here += (codes.at(k) - had.at(k)) * (codes.at(k) - had.at(k));
    const double apart = std::min({least_squares(codes, 8, false, two), least_squares(codes, 6, false, three)});
    const double shared = least_squares(codes, 7, true, four);
    // A mode that shares places has to be better by a code squared a texel.
    EXPECT_GE(here, std::min(apart, shared));
    EXPECT_LE(here, 1.5 * std::min(apart, shared + 16) + 1);
    own += here;
    best += std::min(apart, shared + 16);
  }
  EXPECT_LE(own, 1.05 * best);
}

}  // namespace
}  // namespace reliefbench
