#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "kernels/maps/block_codec.h"

namespace reliefbench {
namespace {

using DecodedBytes = std::array<std::uint8_t, 16>;

/// The specification's own way: fields one after the other, in a text of 128 digits whose first one is bit 0.
class SlowBc7 {
 public:
  explicit SlowBc7(const DecodedBytes& block) {
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

RC_GTEST_PROP(PairDecode, bc7_decodes_as_specified, ()) {
  DecodedBytes block{};
  for (std::uint8_t& byte : block) byte = *rc::gen::arbitrary<std::uint8_t>();
  const unsigned mode = *rc::gen::inRange(4U, 7U);
  block[0] = static_cast<std::uint8_t>((block[0] << (mode + 1) | 1U << mode) & 255U);
  for (const int channel : {0, 1})
    RC_ASSERT(decode_bc7(block, static_cast<std::size_t>(channel)) == SlowBc7(block).channel(channel));
}

TEST(PairDecode, other_modes_of_bc7_are_none_of_ours) {
  for (const auto first :
       {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{4}, std::uint8_t{8}, std::uint8_t{128}, std::uint8_t{0}})
    EXPECT_THAT(decode_bc7(DecodedBytes{first, 255, 255, 255}, 0), ::testing::Each(0));
}

/// The specification's own way, of the two kinds of blocks that are made here, each bit looked up where it lies.
class SlowAstc {
 public:
  explicit SlowAstc(const DecodedBytes& block) : block_(block) {}

  BlockCodes channel(int wanted) const {
    const bool is_dual = bit(10) == 1;
    int v[4];
    int weights[2][16];
    if (!is_dual) {
      const int t = field({23, 24, 31, 32, 39, 46, 47});
      for (int i = 0; i < 4; ++i) {
        constexpr int kBegins[] = {17, 25, 33, 40};
        const int m =
            field({kBegins[i], kBegins[i] + 1, kBegins[i] + 2, kBegins[i] + 3, kBegins[i] + 4, kBegins[i] + 5});
        v[i] = unquantised(trit(t, i), m);
      }
      for (int i = 0; i < 16; ++i) {
        const int at = 127 - 5 * i;
        const int weight = field({at, at - 1, at - 2, at - 3, at - 4});
        weights[0][i] = weights[1][i] = opened((weight << 1) | (weight >> 4));
      }
    } else {
      for (int i = 0; i < 4; ++i) {
        v[i] = 0;
        for (int k = 0; k < 8; ++k) v[i] |= bit(17 + 8 * i + k) << k;
      }
      for (int i = 0; i < 32; ++i) {
        int q = 0;
        for (int k = 0; k < 7 && 7 * (i / 3) + k < 75; ++k) q |= bit(127 - 7 * (i / 3) - k) << k;
        constexpr int kQuints[] = {0, 16, 32, 47, 63};
        weights[i % 2][i / 2] = opened(kQuints[quint(q, i % 3)]);
      }
    }
    BlockCodes codes{};
    for (std::size_t i = 0; i < 16; ++i) {
      const int weight = weights[wanted][i];
      const int* ends = wanted == 0 ? v : v + 2;
      const int low = ends[0] << 8 | ends[0];
      const int high = ends[1] << 8 | ends[1];
      int code = (low * (64 - weight) + high * weight + 32) / 64;
      for (int unit = 32; unit > 1 && code != 65535; unit /= 2)
        if (code >= 2048 * unit / 2) code -= code % unit;
      codes.at(i) = static_cast<std::uint16_t>(code);
    }
    return codes;
  }

 private:
  int bit(int at) const { return block_.at(static_cast<std::size_t>(at / 8)) >> at % 8 & 1; }
  int field(const std::vector<int>& places) const {
    int value = 0;
    for (std::size_t i = 0; i < places.size(); ++i) value |= bit(places[i]) << i;
    return value;
  }
  static int opened(int weight) { return weight > 32 ? weight + 1 : weight; }
  static int unquantised(int trit, int m) {
    const int a = (m & 1) != 0 ? 511 : 0;
    const int f = m >> 5 & 1;
    const int b = f << 8 | (m >> 4 & 1) << 7 | (m >> 3 & 1) << 6 | (m >> 2 & 1) << 5 | (m >> 1 & 1) << 4 | f;
    return (a & 0x80) | ((trit * 5 + b) ^ a) >> 2;
  }
  static int bits(int value, int high, int low) { return value >> low & ((1 << (high - low + 1)) - 1); }
  static int trit(int t, int wanted) {
    int c = bits(t, 4, 0);
    int list[5];
    if (bits(t, 4, 2) == 7) {
      c = bits(t, 7, 5) << 2 | bits(t, 1, 0);
      list[4] = list[3] = 2;
    } else if (bits(t, 6, 5) == 3) {
      list[4] = 2;
      list[3] = bits(t, 7, 7);
    } else {
      list[4] = bits(t, 7, 7);
      list[3] = bits(t, 6, 5);
    }
    if (bits(c, 1, 0) == 3) {
      list[2] = 2;
      list[1] = bits(c, 4, 4);
      list[0] = bits(c, 3, 3) << 1 | (bits(c, 2, 2) & (1 - bits(c, 3, 3)));
    } else if (bits(c, 3, 2) == 3) {
      list[2] = list[1] = 2;
      list[0] = bits(c, 1, 0);
    } else {
      list[2] = bits(c, 4, 4);
      list[1] = bits(c, 3, 2);
      list[0] = bits(c, 1, 1) << 1 | (bits(c, 0, 0) & (1 - bits(c, 1, 1)));
    }
    return list[wanted];
  }
  static int quint(int q, int wanted) {
    int list[3];
    if (bits(q, 2, 1) == 3 && bits(q, 6, 5) == 0) {
      const int off = 1 - bits(q, 0, 0);
      list[2] = bits(q, 0, 0) << 2 | (bits(q, 4, 4) & off) << 1 | (bits(q, 3, 3) & off);
      list[1] = list[0] = 4;
      return list[wanted];
    }
    int c = bits(q, 4, 0);
    list[2] = bits(q, 6, 5);
    if (bits(q, 2, 1) == 3) {
      list[2] = 4;
      c = bits(q, 4, 3) << 3 | (3 - bits(q, 6, 5)) << 1 | bits(q, 0, 0);
    }
    if (bits(c, 2, 0) == 5) {
      list[1] = 4;
      list[0] = bits(c, 4, 3);
    } else {
      list[1] = bits(c, 4, 3);
      list[0] = bits(c, 2, 0);
    }
    return list[wanted];
  }

  DecodedBytes block_;
};

/// Any bits after the fields that say which of our two kinds a block is of; a dual one's second plane is alpha's.
DecodedBytes astc_of_kind(DecodedBytes block, bool is_dual) {
  const unsigned head = (is_dual ? 0x452U : 0x253U) | 4U << 13U;
  block[0] = static_cast<std::uint8_t>(head);
  block[1] = static_cast<std::uint8_t>(head >> 8U);
  block[2] = static_cast<std::uint8_t>((block[2] & 0xFEU) | head >> 16U);
  if (is_dual) block[6] = static_cast<std::uint8_t>(block[6] | 0x18U);
  return block;
}

RC_GTEST_PROP(PairDecode, astc_decodes_as_specified, ()) {
  DecodedBytes block{};
  for (std::uint8_t& byte : block) byte = *rc::gen::arbitrary<std::uint8_t>();
  block = astc_of_kind(block, *rc::gen::arbitrary<bool>());
  for (const int channel : {0, 1})
    RC_ASSERT(decode_astc(block, static_cast<std::size_t>(channel)) == SlowAstc(block).channel(channel));
}

TEST(PairDecode, other_blocks_of_astc_are_none_of_ours) {
  EXPECT_THAT(decode_astc(DecodedBytes{0xFC, 0xFD, 255, 255}, 0), ::testing::Each(0));
  EXPECT_THAT(decode_astc(DecodedBytes{0x53, 0x02, 255, 255}, 0), ::testing::Each(0));
}

}  // namespace
}  // namespace reliefbench
