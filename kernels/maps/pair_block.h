#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "kernels/maps/block_codec.h"

namespace reliefbench {

// Blocks that have both channels in 16 bytes. Heights come first, since cones are baked from what they decode to: modes
// differ in what they keep of them, and of those that have a block's heights the ratios get the one that is best.

[[nodiscard]] constexpr int code_between(int low, int high, int weight) {
  return ((64 - weight) * low + weight * high + 32) >> 6;
}
/// What a channel has in a block: two endpoints, and for each texel a place between them.
struct BlockPlane {
  std::span<const std::uint16_t> ends;    ///< codes that an endpoint may have, rising
  std::span<const std::uint8_t> weights;  ///< of the second endpoint at each place, in 64ths; rising from 0 to 64
  int (*code)(int low, int high, int weight) = code_between;  ///< of a place; an endpoint's own at its end
};

/// A block's bits, from the lowest of the first byte on.
class BlockBits {
 public:
  explicit BlockBits(std::span<std::uint8_t> bytes) : bytes_(bytes) {}
  void append(std::size_t value, unsigned count) {
    for (unsigned i = 0; i < count; ++i, ++at_)
      bytes_[at_ / 8] = static_cast<std::uint8_t>(bytes_[at_ / 8] | (value >> i & 1U) << at_ % 8);
  }

 private:
  std::span<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};
class BlockBitReader {
 public:
  explicit BlockBitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  unsigned next(unsigned count) {
    unsigned value = 0;
    for (unsigned i = 0; i < count; ++i, ++at_) value |= (bytes_[at_ / 8] >> at_ % 8 & 1U) << i;
    return value;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

/// One way to split a block's bits.
struct PairMode {
  BlockPlane first, second;
  bool is_shared = false;  ///< a texel has the same place in both planes
};

/// Both ends as indices into BlockPlane::ends; places by their weights' indices.
struct PlaneFit {
  std::array<std::size_t, 2> ends{};
  std::array<std::uint8_t, 16> places{};
};
struct PairFit {
  std::size_t mode = 0;
  PlaneFit first, second;
};

/// About the best, as BlockCodec::encode says. The first plane's ends are its least and its greatest code, so that what
/// it decodes to shows which modes have it.
/// modes: one at least has every code as an end of the first plane, and one without sharing both ends of the range as
/// ends of the second
[[nodiscard]] PairFit fit_pair(std::span<const PairMode> modes, const AskedCodes& first, const AskedCodes& second,
                               int greatest);

}  // namespace reliefbench
