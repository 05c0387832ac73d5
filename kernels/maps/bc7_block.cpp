#include <algorithm>
#include <bit>
#include <utility>

#include "kernels/maps/pair_block.h"

namespace reliefbench {
namespace {

/// Endpoints of `bits` bits, whose first ones are repeated.
template <unsigned bits>
constexpr std::array<std::uint16_t, 1U << bits> repeated_ends() {
  std::array<std::uint16_t, 1U << bits> ends{};
  for (unsigned i = 0; i < ends.size(); ++i)
    ends.at(i) = static_cast<std::uint16_t>(i << (8 - bits) | i >> (2 * bits - 8));
  return ends;
}
constexpr auto kEnds5 = repeated_ends<5>();
constexpr auto kEnds6 = repeated_ends<6>();
constexpr auto kEnds7 = repeated_ends<7>();
constexpr auto kEnds8 = repeated_ends<8>();
/// Of mode 6, with the last bit 0. Both channels would share it, and ratios must be able to be 0.
constexpr auto kEvenEnds = [] {
  std::array<std::uint16_t, 128> ends{};
  for (unsigned i = 0; i < ends.size(); ++i) ends.at(i) = static_cast<std::uint16_t>(2 * i);
  return ends;
}();

constexpr std::array<std::uint8_t, 4> kWeights2{0, 21, 43, 64};
constexpr std::array<std::uint8_t, 8> kWeights3{0, 9, 18, 27, 37, 46, 55, 64};
constexpr std::array<std::uint8_t, 16> kWeights4{0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64};

/// In modes 4 and 5 one channel is alpha's, which the rotation swaps with red, 1, or green, 2.
struct Bc7Mode {
  unsigned mode = 0, rotation = 0, index_mode = 0;
};
/// index_mode: 1 where colour has three bits a place in mode 4, and alpha two.
constexpr std::array<Bc7Mode, 7> kBits{{{5, 1, 0}, {5, 2, 0}, {4, 1, 0}, {4, 1, 1}, {4, 2, 0}, {4, 2, 1}, {6, 0, 0}}};
constexpr std::array<PairMode, kBits.size()> kBc7Modes{{
    {.first = {kEnds8, kWeights2}, .second = {kEnds7, kWeights2}},
    {.first = {kEnds7, kWeights2}, .second = {kEnds8, kWeights2}},
    {.first = {kEnds6, kWeights3}, .second = {kEnds5, kWeights2}},
    {.first = {kEnds6, kWeights2}, .second = {kEnds5, kWeights3}},
    {.first = {kEnds5, kWeights2}, .second = {kEnds6, kWeights3}},
    {.first = {kEnds5, kWeights3}, .second = {kEnds6, kWeights2}},
    {.first = {kEvenEnds, kWeights4}, .second = {kEvenEnds, kWeights4}, .is_shared = true},
}};

/// Bits of an index among so many.
unsigned bits_of(std::size_t count) { return static_cast<unsigned>(std::bit_width(count - 1)); }

using Places = std::array<std::uint8_t, 16>;

/// The first texel's place lies in the lower half, and its first bit is not kept. Returns whether that swaps the ends.
bool turn(Places& places, std::size_t count) {
  if (places[0] < count / 2) return false;
  for (std::uint8_t& place : places) place = static_cast<std::uint8_t>(count - 1 - place);
  return true;
}

void append_places(BlockBits& bits, const Places& places, std::size_t count) {
  for (std::size_t i = 0; i < places.size(); ++i) bits.append(places.at(i), bits_of(count) - (i == 0 ? 1 : 0));
}

Places next_places(BlockBitReader& bits, std::size_t count) {
  Places places{};
  for (std::size_t i = 0; i < places.size(); ++i)
    places.at(i) = static_cast<std::uint8_t>(bits.next(bits_of(count) - (i == 0 ? 1 : 0)));
  return places;
}

constexpr std::size_t kAlpha = 3;

/// A channel before the rotation.
std::size_t source_of(const Bc7Mode& mode, std::size_t channel) {
  return mode.rotation == channel + 1 ? kAlpha : channel;
}

/// Of modes 4 to 6, for the endpoints of a channel.
unsigned end_bits(unsigned mode, std::size_t channel) {
  if (mode == 6) return 7;
  return (mode == 4 ? 5U : 7U) + (channel == kAlpha ? 1U : 0U);
}

}  // namespace

void encode_bc7(std::span<const AskedCodes> channels, std::span<std::uint8_t> block) {
  const AskedCodes none{.codes = {}, .rounding = BlockRounding::below};
  PairFit fit = fit_pair(kBc7Modes, channels[0], channels.size() > 1 ? channels[1] : none, 255);
  const PairMode& planes = kBc7Modes.at(fit.mode);
  const Bc7Mode& mode = kBits.at(fit.mode);
  const std::size_t count = planes.first.weights.size();
  const std::size_t second_count = planes.second.weights.size();
  const bool turns = turn(fit.first.places, count);
  if (turns) std::swap(fit.first.ends[0], fit.first.ends[1]);
  if (planes.is_shared ? turns : turn(fit.second.places, second_count))
    std::swap(fit.second.ends[0], fit.second.ends[1]);
  std::array<std::array<std::size_t, 2>, 4> ends{};
  ends.at(source_of(mode, 0)) = fit.first.ends;
  ends.at(source_of(mode, 1)) = fit.second.ends;

  std::ranges::fill(block, std::uint8_t{0});
  BlockBits bits(block);
  bits.append(std::size_t{1} << mode.mode, mode.mode + 1);
  if (mode.mode < 6) bits.append(mode.rotation, 2);
  if (mode.mode == 4) bits.append(mode.index_mode, 1);
  for (std::size_t channel = 0; channel < ends.size(); ++channel)
    for (const std::size_t end : ends.at(channel)) bits.append(end, end_bits(mode.mode, channel));
  if (planes.is_shared) {
    bits.append(0, 2);
    append_places(bits, fit.first.places, count);
    return;
  }
  // Those of colour come first, or in mode 4 those of fewer bits.
  if ((mode.rotation == 1) != (mode.index_mode == 1)) {
    append_places(bits, fit.second.places, second_count);
    append_places(bits, fit.first.places, count);
  } else {
    append_places(bits, fit.first.places, count);
    append_places(bits, fit.second.places, second_count);
  }
}

BlockCodes decode_bc7(std::span<const std::uint8_t> block, std::size_t channel) {
  BlockBitReader bits(block);
  Bc7Mode mode{.mode = 0};
  while (mode.mode < 8 && bits.next(1) == 0) ++mode.mode;
  if (mode.mode < 4 || mode.mode > 6) return {};
  if (mode.mode < 6) mode.rotation = bits.next(2);
  if (mode.mode == 4) mode.index_mode = bits.next(1);
  std::array<std::array<unsigned, 2>, 4> ends{};
  for (std::size_t c = 0; c < ends.size(); ++c)
    for (unsigned& end : ends.at(c)) {
      const unsigned count = end_bits(mode.mode, c);
      end = bits.next(count) << (8 - count);
      if (mode.mode != 6) end |= end >> count;
    }
  for (std::size_t i = 0; mode.mode == 6 && i < 2; ++i) {
    const unsigned last = bits.next(1);
    for (auto& of_channel : ends) of_channel.at(i) |= last;
  }
  const std::size_t source = source_of(mode, channel);
  std::span<const std::uint8_t> weights = kWeights2;
  if (mode.mode == 6) weights = kWeights4;
  Places places = next_places(bits, weights.size());
  if (mode.mode < 6 && (source == kAlpha) != (mode.index_mode == 1)) {
    if (mode.mode == 4) weights = kWeights3;
    places = next_places(bits, weights.size());
  }
  BlockCodes codes{};
  const auto [low, high] = ends.at(source);
  for (std::size_t i = 0; i < codes.size(); ++i)
    codes.at(i) =
        static_cast<std::uint16_t>(code_between(static_cast<int>(low), static_cast<int>(high), weights[places.at(i)]));
  return codes;
}

}  // namespace reliefbench
