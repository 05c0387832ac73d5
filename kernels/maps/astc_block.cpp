#include <algorithm>
#include <bit>
#include <utility>

#include "kernels/maps/pair_block.h"

namespace reliefbench {
namespace {

/// The first 11 bits of a code: what is left of it as binary16, rounded towards 0. All 16 are 1.
constexpr int as_half(int code) {
  if (code == 65535) return code;
  const int spare = std::max(static_cast<int>(std::bit_width(static_cast<unsigned>(code))) - 11, 0);
  return code >> spare << spare;
}
/// Between endpoints of 8 bits, whose codes begin with them.
constexpr int astc_code(int low, int high, int weight) {
  return as_half(code_between(257 * (low >> 8), 257 * (high >> 8), weight));
}

// A trit and 6 bits: in the block's own order, which is not that of what they stand for.
constexpr std::size_t kTritEnds = 192;
constexpr unsigned trit_end(std::size_t value) {
  const auto bits = static_cast<unsigned>(value % 64);
  const unsigned all = (bits & 1U) != 0 ? 0x1FFU : 0U;
  const unsigned spread = (5 * static_cast<unsigned>(value / 64) + ((bits & 0x3EU) << 3U | bits >> 5U)) ^ all;
  return (all & 0x80U) | spread >> 2U;
}
/// The stored numbers by what they stand for, rising.
constexpr auto kTritOrder = [] {
  std::array<std::uint8_t, kTritEnds> order{};
  for (std::size_t i = 0; i < order.size(); ++i) order.at(i) = static_cast<std::uint8_t>(i);
  std::ranges::sort(order, {}, trit_end);
  return order;
}();
constexpr auto kEndsOfTrits = [] {
  std::array<std::uint16_t, kTritEnds> ends{};
  for (std::size_t i = 0; i < ends.size(); ++i)
    ends.at(i) = static_cast<std::uint16_t>(as_half(static_cast<int>(257 * trit_end(kTritOrder.at(i)))));
  return ends;
}();
constexpr auto kEndsOf8Bits = [] {
  std::array<std::uint16_t, 256> ends{};
  for (int i = 0; i < 256; ++i) ends.at(static_cast<std::size_t>(i)) = static_cast<std::uint16_t>(as_half(257 * i));
  return ends;
}();

constexpr auto kWeights5Bits = [] {
  std::array<std::uint8_t, 32> weights{};
  for (std::size_t i = 0; i < weights.size(); ++i) weights.at(i) = static_cast<std::uint8_t>(2 * i + i / 16 + i / 16);
  return weights;
}();
static_assert(kWeights5Bits.at(15) == 30 && kWeights5Bits.at(16) == 34 && kWeights5Bits.back() == 64);
constexpr std::array<std::uint8_t, 5> kQuintWeights{0, 16, 32, 48, 64};

constexpr BlockPlane kSharedPlane{.ends = kEndsOfTrits, .weights = kWeights5Bits, .code = astc_code};
constexpr BlockPlane kOwnPlane{.ends = kEndsOf8Bits, .weights = kQuintWeights, .code = astc_code};
constexpr std::array<PairMode, 2> kAstcModes{{
    {.first = kSharedPlane, .second = kSharedPlane, .is_shared = true},
    {.first = kOwnPlane, .second = kOwnPlane},
}};
/// 4 x 4 weights of 5 bits; two planes of them, of quints.
constexpr std::array<unsigned, 2> kBlockModes{0x253, 0x452};
constexpr unsigned kLuminanceAndAlpha = 4;
constexpr unsigned kAlphaHasTheSecondPlane = 3;

/// Five trits of 8 bits.
constexpr std::array<unsigned, 5> trits_of(unsigned bits) {
  const auto bit = [](unsigned value, unsigned at) { return value >> at & 1U; };
  std::array<unsigned, 5> trits{};
  unsigned rest = bits & 31U;
  if ((bits >> 2U & 7U) == 7) {
    rest = bits >> 5U << 2U | (bits & 3U);
    trits[3] = trits[4] = 2;
  } else if ((bits >> 5U & 3U) == 3) {
    trits[3] = bits >> 7U;
    trits[4] = 2;
  } else {
    trits[3] = bits >> 5U & 3U;
    trits[4] = bits >> 7U;
  }
  if ((rest & 3U) == 3) {
    trits[0] = bit(rest, 3) << 1U | (bit(rest, 2) & ~bit(rest, 3));
    trits[1] = bit(rest, 4);
    trits[2] = 2;
  } else if ((rest >> 2U & 3U) == 3) {
    trits[0] = rest & 3U;
    trits[1] = trits[2] = 2;
  } else {
    trits[0] = bit(rest, 1) << 1U | (bit(rest, 0) & ~bit(rest, 1));
    trits[1] = rest >> 2U & 3U;
    trits[2] = bit(rest, 4);
  }
  return trits;
}

/// Three quints of 7 bits.
constexpr std::array<unsigned, 3> quints_of(unsigned bits) {
  const auto bit = [&](unsigned at) { return bits >> at & 1U; };
  if ((bits >> 1U & 3U) == 3 && bits >> 5U == 0)
    return {4, 4, bit(0) << 2U | (bit(4) & ~bit(0)) << 1U | (bit(3) & ~bit(0))};
  unsigned rest = bits & 31U;
  unsigned third = bits >> 5U;
  if ((bits >> 1U & 3U) == 3) {
    rest = (bits >> 3U & 3U) << 3U | (~bits >> 5U & 3U) << 1U | bit(0);
    third = 4;
  }
  if ((rest & 7U) == 5) return {rest >> 3U, 4, third};
  return {rest & 7U, rest >> 3U, third};
}

/// The least number whose digits these are.
template <std::size_t size>
unsigned packed_digits(std::array<unsigned, size> (*digits_of)(unsigned), const std::array<unsigned, size>& digits) {
  unsigned bits = 0;
  while (digits_of(bits) != digits) ++bits;
  return bits;
}

using BlockOfBytes = std::array<std::uint8_t, 16>;

/// Weights grow from the other end of the block, every bit of them.
BlockOfBytes turned_round(const BlockOfBytes& block) {
  BlockOfBytes turned{};
  for (std::size_t i = 0; i < 128; ++i)
    turned.at((127 - i) / 8) |= static_cast<std::uint8_t>((block.at(i / 8) >> i % 8 & 1U) << (127 - i) % 8);
  return turned;
}

/// The places of a texel in both planes follow each other.
std::size_t place_in_pairs(const PairFit& fit, std::size_t index) {
  return index % 2 == 0 ? fit.first.places.at(index / 2) : fit.second.places.at(index / 2);
}

}  // namespace

void encode_astc(std::span<const AskedCodes> channels, std::span<std::uint8_t> block) {
  const AskedCodes none{.rounding = BlockRounding::below};
  const PairFit fit = fit_pair(kAstcModes, channels[0], channels.size() > 1 ? channels[1] : none, 65535);
  const std::array<std::size_t, 4> ends{fit.first.ends[0], fit.first.ends[1], fit.second.ends[0], fit.second.ends[1]};
  const bool is_shared = kAstcModes.at(fit.mode).is_shared;
  BlockOfBytes bytes{};
  BlockOfBytes weights{};
  BlockBits bits(bytes);
  BlockBits weight_bits(weights);
  bits.append(kBlockModes.at(fit.mode), 11);
  bits.append(0, 2);  // one partition
  bits.append(kLuminanceAndAlpha, 4);
  if (is_shared) {
    std::array<unsigned, 5> trits{};
    for (std::size_t i = 0; i < ends.size(); ++i) trits.at(i) = kTritOrder.at(ends.at(i)) / 64U;
    const unsigned packed = packed_digits(trits_of, trits);
    constexpr std::array<unsigned, 4> kFirstBits{0, 2, 4, 5};  // of those that follow a value
    for (std::size_t i = 0; i < ends.size(); ++i) {
      bits.append(kTritOrder.at(ends.at(i)) % 64U, 6);
      bits.append(packed >> kFirstBits.at(i), i == 2 ? 1 : 2);
    }
    for (const std::uint8_t place : fit.first.places) weight_bits.append(place, 5);
  } else {
    for (const std::size_t end : ends) bits.append(end, 8);
    for (std::size_t i = 0; i < 32; i += 3) {
      std::array<unsigned, 3> quints{};
      for (std::size_t k = 0; k < 3 && i + k < 32; ++k)
        quints.at(k) = static_cast<unsigned>(place_in_pairs(fit, i + k));
      weight_bits.append(packed_digits(quints_of, quints), i + 3 > 32 ? 5 : 7);
    }
    weight_bits.append(kAlphaHasTheSecondPlane, 2);
  }
  weights = turned_round(weights);
  for (std::size_t i = 0; i < block.size(); ++i) block[i] = bytes.at(i) | weights.at(i);
}

BlockCodes decode_astc(std::span<const std::uint8_t> block, std::size_t channel) {
  BlockOfBytes bytes{};
  std::ranges::copy(block, bytes.begin());
  const BlockOfBytes turned = turned_round(bytes);
  BlockBitReader bits(bytes);
  BlockBitReader weight_bits(turned);
  const unsigned block_mode = bits.next(11);
  if (std::ranges::find(kBlockModes, block_mode) == kBlockModes.end()) return {};
  const bool is_shared = block_mode == kBlockModes[0];
  if (bits.next(6) != kLuminanceAndAlpha << 2U) return {};
  std::array<unsigned, 4> ends{};
  std::array<unsigned, 33> places{};
  if (is_shared) {
    constexpr std::array<unsigned, 4> kFirstBits{0, 2, 4, 5};
    unsigned packed = 0;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      ends.at(i) = bits.next(6);
      packed |= bits.next(i == 2 ? 1 : 2) << kFirstBits.at(i);
    }
    const std::array<unsigned, 5> trits = trits_of(packed);
    for (std::size_t i = 0; i < ends.size(); ++i) ends.at(i) = trit_end(64 * trits.at(i) + ends.at(i));
    for (std::size_t i = 0; i < 16; ++i) places.at(2 * i) = places.at(2 * i + 1) = weight_bits.next(5);
  } else {
    for (unsigned& end : ends) end = bits.next(8);
    for (std::size_t i = 0; i < 32; i += 3) {
      const std::array<unsigned, 3> quints = quints_of(weight_bits.next(i + 3 > 32 ? 5 : 7));
      std::ranges::copy(quints, places.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  const std::span<const std::uint8_t> weights =
      is_shared ? std::span<const std::uint8_t>(kWeights5Bits) : kQuintWeights;
  BlockCodes codes{};
  for (std::size_t i = 0; i < codes.size(); ++i)
    codes.at(i) = static_cast<std::uint16_t>(astc_code(static_cast<int>(ends.at(2 * channel)) << 8,
                                                       static_cast<int>(ends.at(2 * channel + 1)) << 8,
                                                       weights[places.at(2 * i + channel)]));
  return codes;
}

}  // namespace reliefbench
