#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include "kernels/maps/block_codec.h"

namespace reliefbench {
namespace {

constexpr int kGreatest = 2047;
constexpr int kEacPlaces = 8;
constexpr int kTables = 16;
constexpr int kMultipliers = 16;
constexpr int kBases = 256;

/// The first four modifiers of each table, by index; -1 less each are the other four.
constexpr std::array<std::array<int, 4>, kTables> kFirstModifiers{{{-3, -6, -9, -15},
                                                                   {-3, -7, -10, -13},
                                                                   {-2, -5, -8, -13},
                                                                   {-2, -4, -6, -13},
                                                                   {-3, -6, -8, -12},
                                                                   {-3, -7, -9, -11},
                                                                   {-4, -7, -8, -11},
                                                                   {-3, -5, -8, -11},
                                                                   {-2, -6, -8, -10},
                                                                   {-2, -5, -8, -10},
                                                                   {-2, -4, -8, -10},
                                                                   {-2, -5, -7, -10},
                                                                   {-3, -4, -7, -10},
                                                                   {-1, -2, -3, -10},
                                                                   {-4, -6, -8, -9},
                                                                   {-3, -5, -7, -9}}};
/// The index of a place in the rising order of a table's modifiers.
constexpr std::array<int, kEacPlaces> kIndexOfPlace{3, 2, 1, 0, 4, 5, 6, 7};

using Modifiers = std::array<int, kEacPlaces>;
constexpr std::array<Modifiers, kTables> rising_modifiers() {
  std::array<Modifiers, kTables> tables{};
  for (std::size_t table = 0; table < kTables; ++table)
    for (std::size_t i = 0; i < 4; ++i) {
      tables.at(table).at(3 - i) = kFirstModifiers.at(table).at(i);
      tables.at(table).at(4 + i) = -1 - kFirstModifiers.at(table).at(i);
    }
  return tables;
}
constexpr std::array<Modifiers, kTables> kModifiers = rising_modifiers();

constexpr int scale_of(int multiplier) { return multiplier == 0 ? 1 : 8 * multiplier; }

/// What a block has before its indices.
struct EacPalette {
  int base = 0;
  int multiplier = 0;
  std::size_t table = 0;

  /// The values of its places, rising.
  [[nodiscard]] Modifiers values() const {
    Modifiers values = kModifiers[table];
    for (int& value : values) value = std::clamp(8 * base + 4 + value * scale_of(multiplier), 0, kGreatest);
    return values;
  }
};

bool is_end(int code) { return code == 0 || code == kGreatest; }

/// A palette that has all the codes.
std::optional<EacPalette> exact_eac_palette(const BlockCodes& codes) {
  const auto* const found = std::ranges::find_if_not(codes, is_end);
  if (found == codes.end()) return EacPalette{.base = 130, .multiplier = 14, .table = 13};  // it has both ends
  const int inner = *found;
  // Only the least scale leads to codes that are not 4 more than a multiple of 8.
  const bool is_coarse = std::ranges::all_of(codes, [](int code) { return is_end(code) || code % 8 == 4; });
  for (int multiplier = 0; multiplier < (is_coarse ? kMultipliers : 1); ++multiplier)
    for (std::size_t table = 0; table < kTables; ++table)
      for (const int modifier : kModifiers[table]) {
        const int start = inner - modifier * scale_of(multiplier);
        if (start < 4 || start % 8 != 4 || start / 8 >= kBases) continue;
        const EacPalette palette{.base = start / 8, .multiplier = multiplier, .table = table};
        const Modifiers values = palette.values();
        if (std::ranges::all_of(codes, [&](int code) { return std::ranges::find(values, code) != values.end(); }))
          return palette;
      }
  return std::nullopt;
}

/// Quotients by 1 to 2048.
const std::array<double, kGreatest + 2>& reciprocals() {
  static const std::array<double, kGreatest + 2> table = [] {
    std::array<double, kGreatest + 2> made{};
    for (std::size_t i = 1; i < made.size(); ++i) made[i] = 1 / static_cast<double>(i);
    return made;
  }();
  return table;
}

constexpr double kWorstCost = std::numeric_limits<double>::infinity();

/// The search for the palette that costs least. Rounding above is rounding below of complements: then all codes and
/// values here are complements.
class EacSearch {
 public:
  EacSearch(BlockCodes codes, BlockRounding rounding) : rounding_(rounding) {
    if (rounding == BlockRounding::above)
      for (std::uint16_t& code : codes) code = static_cast<std::uint16_t>(kGreatest - code);
    std::ranges::sort(codes);
    low_ = codes.front();
    high_ = codes.back();
    std::size_t below = 0;
    for (std::size_t i = 0; i < codes.size(); ++i) {
      const std::int64_t term = codes.at(i) + (rounding == BlockRounding::nearest ? 0 : 1);
      sums_[i + 1] = sums_[i] + term;
      squares_[i + 1] = squares_[i] + term * term;
      for (; below < codes.at(i) - static_cast<std::size_t>(low_); ++below)
        counts_[below] = static_cast<std::uint8_t>(i);
    }
  }

  [[nodiscard]] EacPalette best() {
    // The likeliest multiplier comes first, for what is found bounds the search.
    constexpr int kUsualReach = 20;  // of a table
    const int range = high_ - low_;
    const int likeliest = range < 2 * kUsualReach ? 0 : std::clamp(range / (8 * kUsualReach), 1, kMultipliers - 1);
    for (int off = 0; off < kMultipliers; ++off) {
      if (likeliest + off < kMultipliers) look_at(likeliest + off);
      if (off > 0 && likeliest - off >= 0) look_at(likeliest - off);
    }
    assert(least_ < kWorstCost);
    return best_;
  }

 private:
  /// Codes up to `code`.
  [[nodiscard]] std::size_t count_to(int code) const {
    if (code < low_) return 0;
    return code >= high_ ? sums_.size() - 1 : counts_[static_cast<std::size_t>(code - low_)];
  }

  [[nodiscard]] double nearest_cost(const Modifiers& values) const {
    std::int64_t sum = 0;
    std::size_t from = 0;
    for (std::size_t i = 0; i < kEacPlaces; ++i) {
      const std::size_t to = i + 1 < kEacPlaces ? count_to((values[i] + values[i + 1]) / 2) : sums_.size() - 1;
      const std::int64_t value = values[i];
      const auto count = static_cast<std::int64_t>(to - from);
      sum += squares_[to] - squares_[from] - value * (2 * (sums_[to] - sums_[from]) - count * value);
      from = to;
    }
    return static_cast<double>(sum);
  }

  /// Counted no further where it promises nothing.
  [[nodiscard]] double cost_below(const Modifiers& values) const {
    if (values.front() > low_) return kWorstCost;
    double sum = -static_cast<double>(sums_.size() - 1);
    std::size_t from = 0;
    for (std::size_t i = 0; i < kEacPlaces; ++i) {
      const std::size_t to = i + 1 < kEacPlaces ? count_to(values[i + 1] - 1) : sums_.size() - 1;
      if (to == from) continue;
      sum += static_cast<double>(sums_[to] - sums_[from]) * reciprocals_[static_cast<std::size_t>(values[i]) + 1];
      from = to;
      if (sum >= kPromising * least_) return kWorstCost;
    }
    return sum;
  }

  void look_at(int multiplier) {
    const int scale = scale_of(multiplier);
    for (std::size_t table = 0; table < kTables; ++table) {
      const Modifiers& modifiers = kModifiers[table];
      // So coarse a palette has too few values in the range.
      if (multiplier > 1 && 5 * scale * (modifiers[6] - modifiers[1]) > 8 * (high_ - low_) + 80) continue;
      const bool is_mirrored = rounding_ == BlockRounding::above;
      const int first = scale * (is_mirrored ? -modifiers[7] : modifiers[0]);
      const int last = scale * (is_mirrored ? -modifiers[0] : modifiers[7]);
      // The start is where the modifier is 0. The ends' own costs alone may be too much.
      int least_start = std::max(low_ - last, high_ - most_under_the_greatest() - last);
      int greatest_start = std::min(high_ - first, low_ + most_over_the_least() - first);
      if (is_mirrored) {
        std::swap(least_start, greatest_start);
        least_start = kGreatest - least_start;
        greatest_start = kGreatest - greatest_start;
      }
      const int end = std::min((greatest_start + 4) / 8, kBases);
      // Between bases half of the scale apart the others are looked at where these are good.
      const int step = std::max(multiplier / 2, 1);
      for (int base = std::max((least_start + 3) / 8, 0); base < end; base += step) {
        if (take({.base = base, .multiplier = multiplier, .table = table}) >= kPromising * least_) continue;
        for (int between = std::max(base - step + 1, 0); between < std::min(base + step, kBases); ++between)
          if (between != base) take({.base = between, .multiplier = multiplier, .table = table});
      }
    }
  }

  /// How far the last value may lie under the greatest code.
  [[nodiscard]] int most_under_the_greatest() const {
    if (least_ == kWorstCost) return kGreatest;
    if (rounding_ == BlockRounding::nearest) return static_cast<int>(std::sqrt(least_));
    return high_ + 1 - static_cast<int>((high_ + 1) / (least_ + 1));
  }
  /// How far the first value may lie over the least code.
  [[nodiscard]] int most_over_the_least() const {
    if (rounding_ != BlockRounding::nearest) return 0;
    return least_ == kWorstCost ? kGreatest : static_cast<int>(std::sqrt(least_));
  }

  /// returns: its cost, or more where that is over kPromising times the least
  double take(const EacPalette& palette) {
    Modifiers values = palette.values();
    if (rounding_ == BlockRounding::above) {
      std::ranges::reverse(values);
      for (int& value : values) value = kGreatest - value;
    }
    const double cost = rounding_ == BlockRounding::nearest ? nearest_cost(values) : cost_below(values);
    if (cost < least_) {
      least_ = cost;
      best_ = palette;
    }
    return cost;
  }

  static constexpr double kPromising = 1.5;

  BlockRounding rounding_;
  int low_ = 0;
  int high_ = 0;
  std::array<std::int64_t, 17> sums_{};     // of the least codes
  std::array<std::int64_t, 17> squares_{};  // likewise
  std::array<std::uint8_t, kGreatest + 1> counts_{};
  const std::array<double, kGreatest + 2>& reciprocals_ = reciprocals();
  double least_ = kWorstCost;
  EacPalette best_;
};

/// The place of the palette's value for a code.
int place_of_code(const Modifiers& values, int code, BlockRounding rounding) {
  int best = -1;
  for (int i = 0; i < kEacPlaces; ++i) {
    const int off = values.at(static_cast<std::size_t>(i)) - code;
    if ((rounding == BlockRounding::below && off > 0) || (rounding == BlockRounding::above && off < 0)) continue;
    if (best < 0 || std::abs(off) < std::abs(values.at(static_cast<std::size_t>(best)) - code)) best = i;
  }
  assert(best >= 0);
  return best;
}

/// Where a texel's index begins, from the block's lowest bit: column by column, the first one highest.
constexpr int index_shift(int texel) { return 45 - 3 * (texel % 4 * 4 + texel / 4); }

}  // namespace

BlockBytes encode_eac(const BlockCodes& codes, BlockRounding rounding) {
  std::optional<EacPalette> palette = exact_eac_palette(codes);
  if (!palette) palette = EacSearch(codes, rounding).best();
  const Modifiers values = palette->values();
  auto bits = static_cast<std::uint64_t>(palette->base) << 56U |
              static_cast<std::uint64_t>(palette->multiplier) << 52U | std::uint64_t{palette->table} << 48U;
  for (int i = 0; i < 16; ++i) {
    const int place = place_of_code(values, codes.at(static_cast<std::size_t>(i)), rounding);
    bits |= static_cast<std::uint64_t>(kIndexOfPlace.at(static_cast<std::size_t>(place))) << index_shift(i);
  }
  BlockBytes block{};
  for (std::size_t i = 0; i < block.size(); ++i) block.at(i) = static_cast<std::uint8_t>(bits >> (56 - 8 * i));
  return block;
}

BlockCodes decode_eac(const BlockBytes& block) {
  std::uint64_t bits = 0;
  for (const std::uint8_t byte : block) bits = bits << 8U | byte;
  const EacPalette palette{.base = block[0], .multiplier = block[1] >> 4U, .table = block[1] & 15U};
  const Modifiers rising = palette.values();
  std::array<int, kEacPlaces> values{};
  for (std::size_t i = 0; i < kEacPlaces; ++i) values.at(static_cast<std::size_t>(kIndexOfPlace.at(i))) = rising.at(i);
  BlockCodes codes{};
  for (int i = 0; i < 16; ++i)
    codes.at(static_cast<std::size_t>(i)) = static_cast<std::uint16_t>(values.at(bits >> index_shift(i) & 7U));
  return codes;
}

}  // namespace reliefbench
