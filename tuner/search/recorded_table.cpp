#include "tuner/search/recorded_table.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

#include "kernels/base/error.h"
#include "tuner/search/observations.h"
#include "tuner/search/random.h"

namespace reliefbench {

RecordedTable random_part(const RecordedTable& table, double share, std::uint64_t seed) {
  std::vector<std::size_t> chosen(table.samples.size());
  std::iota(chosen.begin(), chosen.end(), std::size_t{0});
  const auto wanted = std::max(1.0, std::floor(share * static_cast<double>(chosen.size())));
  Random random(seed);
  while (static_cast<double>(chosen.size()) > wanted)
    chosen.erase(chosen.begin() + static_cast<std::ptrdiff_t>(random.below(chosen.size())));
  RecordedTable part = table;
  const auto take = [&]<typename Value>(std::vector<Value>& list) {
    if (list.empty()) return;
    std::vector<Value> taken;
    taken.reserve(chosen.size());
    for (const std::size_t i : chosen) taken.push_back(std::move(list[i]));
    list = std::move(taken);
  };
  take(part.space.candidates);
  take(part.samples);
  take(part.memory_bytes);
  return part;
}

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
