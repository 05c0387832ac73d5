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

#include "kernels/base/parallel.h"
#include "kernels/judge/metric.h"

namespace reliefbench {

/// Sums in eight lanes: one addition need not wait for the one before.
inline double sum_of_values(std::span<const float> values) {
  std::array<double, 8> lanes{};
  std::size_t i = 0;
  for (; i + lanes.size() <= values.size(); i += lanes.size())
    for (std::size_t lane = 0; lane < lanes.size(); ++lane) lanes[lane] += static_cast<double>(values[i + lane]);
  for (; i < values.size(); ++i) lanes[0] += static_cast<double>(values[i]);
  return std::accumulate(lanes.begin(), lanes.end(), 0.0);
}

/// The aggregates that are percentiles.
inline constexpr std::array kPercentiles{std::pair(Aggregate::p50, 50.0), std::pair(Aggregate::p95, 95.0),
                                         std::pair(Aggregate::p99, 99.0)};

/// The values of a metric, one a judged pixel, in shares that threads fill.
class MetricValues {
 public:
  MetricValues(const Metric& metric, std::size_t pixels)
      : aggregates_(metric.aggregates), shares_(share_count(pixels)) {}

  /// Fills the share of that number. append(values): its pixels' values
  template <typename Append>
  void fill(std::size_t at, const Append& append) {
    Share& share = shares_[at];
    append(share.values);
    share.sum = sum_of_values(share.values);
    for (const float value : share.values) share.max = std::max(share.max, value);
    if (!has_percentiles()) return;
    share.counts.assign(kBins, 0);
    for (const float value : share.values) ++share.counts[bin_of(value)];
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
    std::vector<float> values;
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
