#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <optional>

#include "kernels/maps/block_codec.h"

namespace reliefbench {
namespace {

constexpr int kGreatestCode = 255;

/// The values of a block: first, first + step, ..., first + intervals * step; with 5 intervals also 0 and 255.
struct BlockPalette {
  int intervals = 7;
  int first = 0;
  int step = 0;

  [[nodiscard]] bool has_ends() const { return intervals == 5; }
  [[nodiscard]] int last() const { return first + intervals * step; }
  /// The 3 bits of a texel of the value.
  [[nodiscard]] unsigned index(int value) const {
    const bool is_end = has_ends() && (value < first || value > last());
    if (is_end) return value == 0 ? 6 : 7;
    const int place = step == 0 ? 0 : (value - first) / step;
    if (place == 0) return has_ends() ? 0 : 1;
    if (place == intervals) return has_ends() ? 1 : 0;
    return static_cast<unsigned>(has_ends() ? place + 1 : intervals + 1 - place);
  }
};

struct CodeRange {
  int least = kGreatestCode;
  int greatest = 0;
};
CodeRange code_range(const BlockCodes& codes, bool without_ends) {
  CodeRange range;
  for (const int code : codes) {
    if (without_ends && (code == 0 || code == kGreatestCode)) continue;
    range.least = std::min(range.least, code);
    range.greatest = std::max(range.greatest, code);
  }
  if (range.least > range.greatest) range = {.least = 0, .greatest = 0};  // nothing but ends
  return range;
}

/// A palette that has all the codes.
std::optional<BlockPalette> exact_palette(const BlockCodes& codes, int intervals) {
  const bool has_ends = intervals == 5;
  const CodeRange range = code_range(codes, has_ends);
  for (int step = has_ends ? 0 : 1; intervals * step <= kGreatestCode; ++step) {
    if (range.greatest - range.least > intervals * step) continue;
    const bool fits = std::ranges::all_of(codes, [&](int code) {
      return (has_ends && (code == 0 || code == kGreatestCode)) || code == range.least ||
             (step > 0 && (code - range.least) % step == 0);
    });
    if (!fits) continue;
    const int used = step == 0 ? 0 : (range.greatest - range.least) / step;
    for (int before = 0; before <= intervals - used; ++before) {
      const BlockPalette palette{.intervals = intervals, .first = range.least - before * step, .step = step};
      if (palette.first >= 0 && palette.last() <= kGreatestCode) return palette;
    }
  }
  return std::nullopt;
}

constexpr double kImpossibleCost = std::numeric_limits<double>::infinity();

int nearest_value(const BlockPalette& palette, int code) {
  const int place = palette.step == 0 ? 0 : (2 * (code - palette.first) + palette.step) / (2 * palette.step);
  int value = palette.first + std::clamp(place, 0, palette.intervals) * palette.step;
  if (palette.has_ends())
    for (const int end : {0, kGreatestCode})
      if (std::abs(code - end) < std::abs(code - value)) value = end;
  return value;
}

/// -1: none is below.
int value_below(const BlockPalette& palette, int code) {
  if (palette.has_ends() && code == kGreatestCode) return kGreatestCode;
  if (code < palette.first) return palette.has_ends() ? 0 : -1;
  const int place = palette.step == 0 ? 0 : std::min((code - palette.first) / palette.step, palette.intervals);
  return palette.first + place * palette.step;
}

/// What a palette costs; not counted further where it is over `most`.
double palette_cost(const BlockPalette& palette, const BlockCodes& codes, bool is_below, double most) {
  double sum = 0;
  for (std::size_t i = 0; i < codes.size() && sum < most; ++i) {
    const int code = codes.at(i);
    if (!is_below) {
      const int off = nearest_value(palette, code) - code;
      sum += off * off;
      continue;
    }
    const int value = value_below(palette, code);
    if (value < 0) return kImpossibleCost;
    sum += (code + 1.0) / (value + 1.0) - 1;
  }
  return sum;
}

/// The best of the palettes that reach about as far as the codes do.
BlockPalette searched_palette(const BlockCodes& codes, bool is_below) {
  BlockPalette best;
  double least = kImpossibleCost;
  for (const int intervals : {7, 5}) {
    const bool has_ends = intervals == 5;
    const auto [low, high] = code_range(codes, has_ends);
    const int most = std::min((high - low) / (intervals - 2) + 1, kGreatestCode / intervals);
    for (int step = has_ends ? 0 : 1; step <= most; ++step) {
      const int first_end = std::min(is_below && !has_ends ? low : low + 2 * step, kGreatestCode - intervals * step);
      for (int first = std::max(low - std::max(step, 7), 0); first <= first_end; ++first) {
        const BlockPalette palette{.intervals = intervals, .first = first, .step = step};
        const double own = palette_cost(palette, codes, is_below, least);
        if (own < least) {
          least = own;
          best = palette;
        }
      }
    }
  }
  assert(least < kImpossibleCost);
  return best;
}

BlockBytes packed_block(const BlockPalette& palette, const BlockCodes& values) {
  const auto first = static_cast<std::uint8_t>(palette.first);
  const auto last = static_cast<std::uint8_t>(palette.last());
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < values.size(); ++i) bits |= std::uint64_t{palette.index(values.at(i))} << (3 * i);
  BlockBytes block{};
  block[0] = palette.has_ends() ? first : last;  // which of the two is greater says how many lie between them
  block[1] = palette.has_ends() ? last : first;
  std::memcpy(block.data() + 2, &bits, 6);
  return block;
}

BlockCodes complements(BlockCodes codes) {
  for (std::uint16_t& code : codes) code = static_cast<std::uint16_t>(kGreatestCode - code);
  return codes;
}

/// The values that the block is to have.
BlockPalette palette_of(const BlockCodes& codes, bool is_below, BlockCodes& values) {
  for (const int intervals : {7, 5})
    if (const std::optional<BlockPalette> exact = exact_palette(codes, intervals)) {
      values = codes;
      return *exact;
    }
  const BlockPalette palette = searched_palette(codes, is_below);
  std::ranges::transform(codes, values.begin(), [&](int code) {
    return static_cast<std::uint16_t>(is_below ? value_below(palette, code) : nearest_value(palette, code));
  });
  return palette;
}

}  // namespace

BlockBytes encode_rgtc(const BlockCodes& codes, BlockRounding rounding) {
  BlockCodes values{};
  const bool is_above = rounding == BlockRounding::above;
  BlockPalette palette = palette_of(is_above ? complements(codes) : codes, rounding != BlockRounding::nearest, values);
  if (!is_above) return packed_block(palette, values);
  palette.first = kGreatestCode - palette.last();
  return packed_block(palette, complements(values));
}

BlockCodes decode_rgtc(const BlockBytes& block) {
  const unsigned first = block[0];
  const unsigned second = block[1];
  const unsigned parts = first > second ? 7 : 5;
  std::array<std::uint8_t, 8> values{block[0], block[1]};
  for (unsigned i = 1; i < parts; ++i)
    values.at(i + 1) = static_cast<std::uint8_t>(((parts - i) * first + i * second) / parts);
  if (parts == 5) values[7] = kGreatestCode;  // and the one before is 0
  std::uint64_t bits = 0;
  std::memcpy(&bits, block.data() + 2, 6);
  BlockCodes codes{};
  for (std::size_t i = 0; i < codes.size(); ++i) codes.at(i) = values.at(bits >> (3 * i) & 7U);
  return codes;
}

}  // namespace reliefbench
