#include "kernels/maps/pair_block.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

namespace reliefbench {
namespace {

constexpr double kNoFit = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostPlaces = 32;
/// By how much less heights must be off for ratios to share their places: the sum of squares, in codes of 8 bits.
constexpr double kSharingCost = 16;

/// The codes of a plane's places, rising.
struct PlaceCodes {
  std::array<std::uint16_t, kMostPlaces> codes{};
  std::size_t count = 0;

  PlaceCodes(const BlockPlane& plane, std::size_t low, std::size_t high) : count(plane.weights.size()) {
    for (std::size_t i = 0; i < count; ++i)
      codes[i] = static_cast<std::uint16_t>(plane.code(plane.ends[low], plane.ends[high], plane.weights[i]));
  }
  [[nodiscard]] std::span<const std::uint16_t> span() const { return {codes.data(), count}; }
};

BlockCodes codes_of(const BlockPlane& plane, const PlaneFit& fit) {
  const PlaceCodes places(plane, fit.ends[0], fit.ends[1]);
  BlockCodes codes{};
  std::ranges::transform(fit.places, codes.begin(), [&](std::uint8_t place) { return places.codes[place]; });
  return codes;
}

double squares(const BlockCodes& codes, const BlockCodes& own) {
  double sum = 0;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const double off = codes[i] - own[i];
    sum += off * off;
  }
  return sum;
}

struct BestPlane {
  double cost = kNoFit;
  PlaneFit fit{};
};

/// Endpoints by their indices: those of the low one and of the high one.
struct EndRange {
  std::size_t first_low = 0, last_high = 0;
};
/// What planes are looked for among, and the codes that they decode to show them again: neither end is farther out
/// than the third one beyond all codes.
EndRange ends_around(const BlockPlane& plane, int least, int greatest) {
  constexpr std::ptrdiff_t kMargin = 2;
  const auto begin = plane.ends.begin();
  const auto end = plane.ends.end();
  const auto below = std::max<std::ptrdiff_t>(std::upper_bound(begin, end, least) - begin - 1 - kMargin, 0);
  const auto above =
      std::min<std::ptrdiff_t>(std::lower_bound(begin, end, greatest) - begin + kMargin, end - begin - 1);
  return {.first_low = static_cast<std::size_t>(below), .last_high = static_cast<std::size_t>(above)};
}

/// Fits planes to a channel's codes.
class PlaneSearch {
 public:
  PlaneSearch(const AskedCodes& asked, int greatest) : asked_(asked), sorted_(asked.codes), greatest_(greatest) {
    std::ranges::sort(sorted_);
  }

  [[nodiscard]] BestPlane best(const BlockPlane& plane) const {
    BestPlane best;
    const auto take = [&](std::size_t low, std::size_t high) {
      const double cost = cost_of(plane, low, high, best.cost);
      if (cost < best.cost) best = {.cost = cost, .fit = {.ends = {low, high}}};
    };
    const int least = sorted_.front();
    const int most = sorted_.back();
    const auto [first_low, last_high] = ends_around(plane, least, most);
    take(place_among(plane.ends, least), place_among(plane.ends, most));
    for (std::size_t low = first_low; low <= last_high; ++low) {
      if (plane.ends[low] > least && cost_of(least, plane.ends[low]) >= best.cost) break;
      for (std::size_t high = last_high + 1; high-- > low;) {
        if (plane.ends[high] < most && cost_of(most, plane.ends[high]) >= best.cost) break;
        take(low, high);
      }
    }
    if (best.cost < kNoFit) best.fit = placed(plane, best.fit.ends);
    return best;
  }

  /// Of those whose texels have these places.
  [[nodiscard]] BestPlane best_at(const BlockPlane& plane, const std::array<std::uint8_t, 16>& places) const {
    BestPlane best;
    std::size_t end = plane.ends.size();
    for (std::size_t low = 0; low < plane.ends.size(); ++low)
      for (std::size_t high = end; high-- > 0;) {
        double cost = 0;
        for (std::size_t i = 0; i < places.size() && cost < best.cost; ++i)
          cost += cost_of(asked_.codes[i], plane.code(plane.ends[low], plane.ends[high], plane.weights[places[i]]));
        if (cost < best.cost) best = {.cost = cost, .fit = {.ends = {low, high}, .places = places}};
        if (asked_.rounding != BlockRounding::below || cost == kNoFit) continue;
        end = high + 1;  // a lower one is worse; and a greater low end leaves no room for a greater one
        break;
      }
    return best;
  }

  /// All that have exactly the codes.
  [[nodiscard]] std::vector<PlaneFit> exact(const BlockPlane& plane) const {
    std::vector<PlaneFit> fits;
    const auto [first_low, last_high] = ends_around(plane, sorted_.front(), sorted_.back());
    for (std::size_t low = first_low; low <= last_high && plane.ends[low] <= sorted_.front(); ++low)
      for (std::size_t high = last_high + 1; high-- > low && plane.ends[high] >= sorted_.back();)
        if (has_all(PlaceCodes(plane, low, high))) fits.push_back(placed(plane, {low, high}));
    return fits;
  }

 private:
  [[nodiscard]] double cost_of(int code, int own) const {
    switch (asked_.rounding) {
      case BlockRounding::nearest:
        return static_cast<double>(code - own) * (code - own);
      case BlockRounding::below:
        return own > code ? kNoFit : (code + 1.0) / (own + 1.0) - 1;
      case BlockRounding::above:
        return own < code ? kNoFit : (greatest_ + 1.0 - code) / (greatest_ + 1.0 - own) - 1;
    }
    return kNoFit;
  }

  /// Where a code belongs among rising ones, no lower than `at`; where none is on the asked side, at the end.
  [[nodiscard]] std::size_t place_among(std::span<const std::uint16_t> rising, int code, std::size_t at = 0) const {
    const auto is_past = [&](int here, int next) {
      if (asked_.rounding == BlockRounding::below) return next <= code;
      return asked_.rounding == BlockRounding::above ? here < code : std::abs(next - code) <= std::abs(here - code);
    };
    while (at + 1 < rising.size() && is_past(rising[at], rising[at + 1])) ++at;
    return at;
  }

  [[nodiscard]] bool has_all(const PlaceCodes& places) const {
    std::size_t at = 0;
    return std::ranges::all_of(sorted_, [&](int code) {
      at = place_among(places.span(), code, at);
      return places.codes[at] == code;
    });
  }

  /// What is over `most` is counted no further.
  [[nodiscard]] double cost_of(const BlockPlane& plane, std::size_t low, std::size_t high, double most) const {
    const PlaceCodes places(plane, low, high);
    std::size_t at = 0;
    int least = 0;
    double sum = 0;
    for (std::size_t i = 0; i < sorted_.size() && sum < most; ++i) {
      at = place_among(places.span(), sorted_[i], at);
      sum += cost_of(sorted_[i], places.codes[at]);
      if (i == 0) least = places.codes[at];
    }
    const EndRange around = ends_around(plane, least, places.codes[at]);
    if (sum >= most || low < around.first_low || high > around.last_high) return kNoFit;
    return sum;
  }

  [[nodiscard]] PlaneFit placed(const BlockPlane& plane, const std::array<std::size_t, 2>& ends) const {
    const PlaceCodes places(plane, ends[0], ends[1]);
    PlaneFit fit{.ends = ends};
    std::ranges::transform(asked_.codes, fit.places.begin(),
                           [&](int code) { return static_cast<std::uint8_t>(place_among(places.span(), code)); });
    return fit;
  }

  AskedCodes asked_;
  BlockCodes sorted_;
  int greatest_;
};

/// The codes of the first channel that the block will have.
BlockCodes first_codes(std::span<const PairMode> modes, const AskedCodes& asked, int greatest) {
  const PlaneSearch search(asked, greatest);
  BlockCodes codes{};
  double least = kNoFit;
  for (const PairMode& mode : modes) {
    const BestPlane best = search.best(mode.first);
    if (best.cost == kNoFit) continue;
    const BlockCodes own = codes_of(mode.first, best.fit);
    const double code_of_8_bits = greatest / 255.0;
    double cost = squares(asked.codes, own);
    if (mode.is_shared) cost += kSharingCost * code_of_8_bits * code_of_8_bits;
    if (cost >= least) continue;
    least = cost;
    codes = own;
  }
  return codes;
}

/// The best second channel for given codes of the first one; the cost is infinite where no mode has those.
double fit_second(std::span<const PairMode> modes, const BlockCodes& first, const AskedCodes& second, int greatest,
                  PairFit& fit) {
  const PlaneSearch heights({.codes = first, .rounding = BlockRounding::nearest}, greatest);
  const PlaneSearch search(second, greatest);
  double least = kNoFit;
  for (std::size_t i = 0; i < modes.size(); ++i)
    for (PlaneFit& own : heights.exact(modes[i].first)) {
      // Heights all alike leave the places to the ratios.
      const bool is_bound = modes[i].is_shared && own.ends[0] != own.ends[1];
      const BestPlane best = is_bound ? search.best_at(modes[i].second, own.places) : search.best(modes[i].second);
      if (best.cost < least) {
        least = best.cost;
        if (modes[i].is_shared) own.places = best.fit.places;
        fit = {.mode = i, .first = own, .second = best.fit};
      }
      if (!modes[i].is_shared) break;
    }
  return least;
}

}  // namespace

PairFit fit_pair(std::span<const PairMode> modes, const AskedCodes& first, const AskedCodes& second, int greatest) {
  PairFit fit;
  if (fit_second(modes, first.codes, second, greatest, fit) < kNoFit) return fit;
  [[maybe_unused]] const double cost = fit_second(modes, first_codes(modes, first, greatest), second, greatest, fit);
  assert(cost < kNoFit);
  return fit;
}

}  // namespace reliefbench
