#include "kernels/maps/pair_block.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

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

rc::Gen<BlockCodes> any_pair_codes(int greatest) {
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

/// Heights are decoded before ratios are known: whatever those are, a block of the same heights has them.
RC_GTEST_PROP(PairBlock, keeps_the_first_channel_and_no_code_above_the_second, ()) {
  for (const TexelType type : {TexelType::bc7, TexelType::astc}) {
    const BlockCodec& codec = find_codec(type);
    const auto greatest = static_cast<int>(greatest_code(type));
    const BlockCodes asked = *any_pair_codes(greatest);
    for (const BlockRounding rounding : {kNearest, kBelow, BlockRounding::above}) {
      const PairBytes alone = encoded(codec, {asked, rounding}, {{}, kBelow});
      const BlockCodes first = codec.decode(alone, 0);
      RC_ASSERT(codec.decode(alone, 1) == BlockCodes{});
      for (std::size_t i = 0; i < first.size(); ++i) {
        RC_ASSERT(rounding != kBelow || first.at(i) <= asked.at(i));
        RC_ASSERT(rounding != BlockRounding::above || first.at(i) >= asked.at(i));
      }
      const BlockCodes second = *any_pair_codes(greatest);
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
    const BlockCodes codes = any_pair_codes(255)(random.split(), 100).value();
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

constexpr std::array<std::uint16_t, 7> kFewEnds{0, 40, 80, 120, 170, 210, 255};
constexpr std::array<std::uint16_t, 4> kFewerEnds{0, 90, 160, 255};
constexpr std::array<std::uint8_t, 5> kFiveWeights{0, 16, 32, 48, 64};
constexpr std::array<std::uint8_t, 3> kThreeWeights{0, 32, 64};
constexpr std::array<PairMode, 2> kSmallModes{{
    {.first = {.ends = kFewEnds, .weights = kFiveWeights},
     .second = {.ends = kFewEnds, .weights = kFiveWeights},
     .is_shared = true},
    {.first = {.ends = kFewEnds, .weights = kThreeWeights}, .second = {.ends = kFewerEnds, .weights = kThreeWeights}},
}};

/// The least cost of ratios below the asked ones, over all endpoints of every mode that has exactly the heights.
double least_below(const BlockCodes& heights, const BlockCodes& ratios) {
  double least = std::numeric_limits<double>::infinity();
  const auto code = [](const BlockPlane& plane, std::size_t low, std::size_t high, std::size_t place) {
    return code_between(plane.ends[low], plane.ends[high], plane.weights[place]);
  };
  for (const auto& [first, second, is_shared] : kSmallModes)
    for (std::size_t a = 0; a < first.ends.size(); ++a)
      for (std::size_t b = 0; b < first.ends.size(); ++b)
        for (std::size_t c = 0; c < second.ends.size(); ++c)
          for (std::size_t d = 0; d < second.ends.size(); ++d) {
            double sum = 0;
            for (std::size_t i = 0; i < heights.size(); ++i) {
              double best = std::numeric_limits<double>::infinity();
              for (std::size_t p = 0; p < first.weights.size(); ++p)
                for (std::size_t q = 0; q < second.weights.size(); ++q) {
                  const int ratio = code(second, c, d, q);
                  if ((is_shared && p != q) || code(first, a, b, p) != heights.at(i) || ratio > ratios.at(i)) continue;
                  best = std::min(best, (ratios.at(i) + 1.0) / (ratio + 1.0) - 1);
                }
              sum += best;
            }
            least = std::min(least, sum);
          }
  return least;
}

TEST(PairBlock, ratios_are_about_the_best_for_their_heights) {
  rc::Random random(5);
  double own = 0;
  double best = 0;
  for (int i = 0; i < 40; ++i) {
    const AskedCodes asked{.codes = any_pair_codes(255)(random.split(), 100).value()};
    const AskedCodes ratios{.codes = any_pair_codes(255)(random.split(), 100).value(), .rounding = kBelow};
    const PairFit fit = fit_pair(kSmallModes, asked, ratios, 255);
    BlockCodes heights{};
    double here = 0;
    for (std::size_t k = 0; k < heights.size(); ++k) {
      const auto code = [&](const BlockPlane& plane, const PlaneFit& own_fit) {
        return code_between(plane.ends[own_fit.ends[0]], plane.ends[own_fit.ends[1]],
                            plane.weights[own_fit.places.at(k)]);
      };
      heights.at(k) = static_cast<std::uint16_t>(code(kSmallModes.at(fit.mode).first, fit.first));
      const int ratio = code(kSmallModes.at(fit.mode).second, fit.second);
      EXPECT_LE(ratio, ratios.codes.at(k));
      here += (ratios.codes.at(k) + 1.0) / (ratio + 1.0) - 1;
    }
    const double least = least_below(heights, ratios.codes);
    EXPECT_GE(here, least - 1e-9);
    own += here;
    best += least;
  }
  EXPECT_LE(own, 1.05 * best);
}

}  // namespace
}  // namespace reliefbench
