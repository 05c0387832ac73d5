#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kernels/base/lanes.h"
#include "kernels/base/parallel.h"
#include "kernels/judge/metric.h"

namespace reliefbench {

inline double sum_of_values(std::span<const float> values) {
  const auto lanes =
      in_lanes<double>(values.size(), [&](double& sum, std::size_t i) { sum += static_cast<double>(values[i]); });
  return std::accumulate(lanes.begin(), lanes.end(), 0.0);
}

/// 0 at least.
inline float max_of_values(std::span<const float> values) {
  const auto lanes = in_lanes<float>(values.size(), [&](float& max, std::size_t i) { max = std::max(max, values[i]); });
  return *std::ranges::max_element(lanes);
}

/// The aggregates that are percentiles.
inline constexpr std::array kPercentiles{std::pair(Aggregate::p50, 50.0), std::pair(Aggregate::p95, 95.0),
                                         std::pair(Aggregate::p99, 99.0)};

/// The values of a metric, one a judged pixel, in shares that threads fill.
class MetricValues {
 public:
  MetricValues(const Metric& metric, std::size_t pixels)
      : aggregates_(metric.aggregates), shares_(share_count(pixels)) {}

  void reserve(std::size_t at, std::size_t size) { shares_[at].values.reserve(size); }
  /// Appends values of the share of that number, in the order of its pixels. add(values): does so
  template <typename Add>
  void append(std::size_t at, const Add& add) {
    add(shares_[at].values);
  }
  /// Once a share has all its values.
  void finish(std::size_t at) {
    Share& share = shares_[at];
    share.sum = sum_of_values(share.values);
    share.max = max_of_values(share.values);
    if (!has_percentiles()) return;
    // Of four parts: a count need not wait for the one before, which is of the same bin.
    std::array<std::array<std::uint32_t, kBins>, 4> parts{};
    for (std::size_t i = 0; i < share.values.size(); ++i) ++parts[i % parts.size()][bin_of(share.values[i])];
    share.counts.resize(kBins);
    for (std::size_t bin = 0; bin < kBins; ++bin)
      share.counts[bin] = std::int64_t{parts[0][bin]} + parts[1][bin] + parts[2][bin] + parts[3][bin];
  }

  /// All shares' numbers, one an aggregate; what they are stays where there is no value.
  void put(std::span<std::optional<double>> numbers) {
    double sum = 0;
    float max = 0;
    std::size_t count = 0;
    for (const Share& share : shares_) {
      sum += share.sum;
      max = std::max(max, share.max);
      count += share.values.size();
    }
    if (count == 0) return;
    const Percentiles percentiles = has_percentiles() ? percentiles_of(count) : Percentiles{};
    std::ranges::transform(aggregates_, numbers.begin(), [&](Aggregate aggregate) {
      if (aggregate == Aggregate::mean) return sum / static_cast<double>(count);
      if (aggregate == Aggregate::max) return static_cast<double>(max);
      return percentiles.at(percentile_of(aggregate));
    });
  }

 private:
  using Percentiles = std::array<double, kPercentiles.size()>;
  static std::size_t percentile_of(Aggregate aggregate) {
    const auto* const found = std::ranges::find(kPercentiles, aggregate, [](const auto& one) { return one.first; });
    return static_cast<std::size_t>(found - kPercentiles.begin());
  }
  [[nodiscard]] bool has_percentiles() const {
    return std::ranges::any_of(aggregates_,
                               [](Aggregate aggregate) { return percentile_of(aggregate) < kPercentiles.size(); });
  }

  /// Values are not negative, so that their bits lie as they do. A bin is an exponent and three bits of the mantissa.
  static constexpr int kBinShift = 20;
  static constexpr std::size_t kBins = 1U << (31 - kBinShift);
  static std::size_t bin_of(float value) { return std::bit_cast<std::uint32_t>(value) >> kBinShift; }

  struct Share {
    UnfilledVector<float> values;
    double sum = 0;
    float max = 0;
    std::vector<std::int64_t> counts;  // a bin
  };

  /// By nearest rank: the smallest value that at least so many percent of all do not exceed. Of the bins that these are
  /// in, all values are looked at.
  Percentiles percentiles_of(std::size_t count) {
    std::vector<std::int64_t> histogram(kBins);
    for (const Share& share : shares_) std::ranges::transform(histogram, share.counts, histogram.begin(), std::plus());
    std::array<std::int64_t, kPercentiles.size()> ranks{};  // within the bin
    std::array<std::size_t, kPercentiles.size()> bins{};
    std::vector<std::vector<float>> same(kBins);
    for (std::size_t i = 0; i < kPercentiles.size(); ++i) {
      const double percent = kPercentiles.at(i).second;
      std::int64_t& rank = ranks.at(i);
      std::size_t& bin = bins.at(i);
      rank = static_cast<std::int64_t>(std::ceil(percent * static_cast<double>(count) / 100)) - 1;
      for (; rank >= histogram[bin]; ++bin) rank -= histogram[bin];
      same[bin].resize(static_cast<std::size_t>(histogram[bin]));
    }
    fetch(same);
    Percentiles percentiles{};
    for (std::size_t i = 0; i < kPercentiles.size(); ++i) {
      std::vector<float>& values = same[bins.at(i)];
      std::ranges::nth_element(values, values.begin() + ranks.at(i));
      percentiles.at(i) = static_cast<double>(values[static_cast<std::size_t>(ranks.at(i))]);
    }
    return percentiles;
  }

  /// Fills those bins that are not empty with their values.
  void fetch(std::vector<std::vector<float>>& bins) const {
    std::vector<std::vector<float*>> ends(shares_.size());  // a share, a bin
    std::vector<float*> end(kBins);
    std::ranges::transform(bins, end.begin(),
                           [](std::vector<float>& bin) { return bin.empty() ? nullptr : bin.data(); });
    for (std::size_t at = 0; at < shares_.size(); ++at) {
      ends[at] = end;
      for (std::size_t bin = 0; bin < kBins; ++bin)
        if (end[bin] != nullptr) end[bin] += shares_[at].counts[bin];
    }
    parallel_for(static_cast<int>(shares_.size()), 0, [&](int at) {
      std::vector<float*>& to = ends[static_cast<std::size_t>(at)];
      for (const float value : shares_[static_cast<std::size_t>(at)].values)
        if (float*& next = to[bin_of(value)]; next != nullptr) *next++ = value;
    });
  }

  std::span<const Aggregate> aggregates_;
  std::vector<Share> shares_;
};

}  // namespace reliefbench
