#include "tuner/search/observations.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/base/error.h"
#include "tuner/search/search.h"

namespace reliefbench {

static_assert(kBlock == 3, "the median statistic is that of triples");

int Observed::blocks() const { return static_cast<int>(frames.size()) / kBlock; }

void draw_block(TimeSource& times, std::size_t candidate, Observed& observed) {
  for (int i = 0; i < kBlock; ++i) {
    const auto index = static_cast<int>(observed.frames.size());
    const double time_ns = times.frame_ns(candidate, index);
    if (!(time_ns > 0) || std::isinf(time_ns))
      fail_input("sample {} of setting {} took {} ns: not a time", index, candidate, time_ns);
    const double log_time = std::log(time_ns);
    observed.frames.insert(std::ranges::upper_bound(observed.frames, log_time), log_time);
  }
}

std::vector<double> median_projection(std::span<const double> values) {
  const std::size_t n = values.size();
  const auto count = [](std::size_t i) { return static_cast<double>(i); };
  // Partners both larger: the smaller of them is the median; both smaller: the larger; one of each: the value itself.
  double above = 0;
  for (std::size_t i = 0; i < n; ++i) above += values[i] * count(n - 1 - i);
  double below = 0;
  std::vector<double> projection;
  projection.reserve(n);
  const double pairs = count(n - 1) * count(n - 2) / 2;
  for (std::size_t i = 0; i < n; ++i) {
    above -= values[i] * count(n - 1 - i);
    projection.push_back((values[i] * count(i) * count(n - 1 - i) + below + above) / pairs);
    below += values[i] * count(i);
  }
  return projection;
}

MedianStatistic median_statistic(std::span<const double> values) {
  const std::vector<double> projection = median_projection(values);
  const auto n = static_cast<double>(values.size());
  MedianStatistic result{.mean = std::accumulate(projection.begin(), projection.end(), 0.0) / n};
  for (const double value : projection) result.variance += (value - result.mean) * (value - result.mean);
  result.variance *= 9 / (n - 1);  // each value is one of three
  return result;
}

}  // namespace reliefbench
