#include "tuner/search/recorded_table.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/error.h"
#include "tuner/search/observations.h"
#include "tuner/search/random.h"

namespace reliefbench {
double true_log_time(std::span<const double> samples) {
  if (samples.empty()) fail_input("a setting without samples has no time");
  std::vector<double> sorted(samples.begin(), samples.end());
  std::ranges::sort(sorted);
  // P(median of 3 <= the r-th of n) = 3 p^2 - 2 p^3 with p = r / n.
  const auto below = [&](std::size_t rank) {
    const double p = static_cast<double>(rank) / static_cast<double>(sorted.size());
    return p * p * (3 - 2 * p);
  };
  double sum = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) sum += (below(i + 1) - below(i)) * std::log(sorted[i]);
  return sum;
}

double ReplaySource::frame_ns(std::size_t candidate, int index) {
  const std::vector<double>& samples = table_.samples.at(candidate);
  const std::uint64_t own = mixed(mixed(mixed(seed_) ^ candidate) ^ static_cast<std::uint64_t>(index));
  std::uint64_t draw = own;
  if (Random(own).uniform() < shared_) {
    constexpr std::uint64_t kOtherStream = 0x5bd1e995;
    draw = mixed(mixed(mixed(seed_ ^ kOtherStream) ^ candidate) ^ static_cast<std::uint64_t>(index / kBlock));
  }
  return samples[draw % samples.size()];
}

}  // namespace reliefbench
