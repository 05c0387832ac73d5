#include "tuner/search/improvement.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace reliefbench {

double expected_improvement(double best, double mean, double deviation) {
  const double gain = best - mean;
  if (!(deviation > 0)) return std::max(gain, 0.0);
  const double z = gain / deviation;
  const double density = std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
  const double below = std::erfc(-z / std::numbers::sqrt2) / 2;
  return std::max(0.0, gain * below + deviation * density);
}

double most_improvement(double best, double mean, double deviation) {
  const double gain = best - mean;
  if (!(gain < 0 && deviation > 0)) return std::max(gain, 0.0) + 0.4 * std::max(deviation, 0.0);
  // The normal density over 1 + z^2, by Mills' ratio; and exp(z^2 / 2) is no less than its series.
  const double square = gain / deviation * (gain / deviation);
  return 0.4 * deviation / ((1 + square) * (1 + square / 2 * (1 + square / 4)));
}

std::size_t Staircase::strip_of(std::size_t rank) const {
  const auto after = std::ranges::upper_bound(strips_, rank, {}, &Strip::begin);
  return static_cast<std::size_t>(after - strips_.begin()) - 1;
}

std::size_t Staircase::end_of(std::size_t strip) const {
  return strip + 1 < strips_.size() ? strips_[strip + 1].begin : ranks_;
}

double Staircase::best(std::size_t rank) const { return strips_[strip_of(rank)].log_time; }

void Staircase::add(std::size_t rank, double log_time) {
  const std::size_t at = strip_of(rank);
  if (log_time >= strips_[at].log_time) return;
  std::size_t last = at + 1;  // strips [at, last) are slower
  while (last < strips_.size() && strips_[last].log_time >= log_time) ++last;
  const std::size_t first = strips_[at].begin == rank ? at : at + 1;
  strips_.erase(strips_.begin() + static_cast<std::ptrdiff_t>(first),
                strips_.begin() + static_cast<std::ptrdiff_t>(last));
  strips_.insert(strips_.begin() + static_cast<std::ptrdiff_t>(first), {.begin = rank, .log_time = log_time});
}

double Staircase::hypervolume() const {
  double area = 0;
  for (std::size_t i = 0; i < strips_.size(); ++i)
    area += static_cast<double>(end_of(i) - strips_[i].begin) * (reference_ - strips_[i].log_time);
  return area;
}

double Staircase::expected_growth(std::size_t rank, double mean, double deviation) const {
  double growth = 0;
  for (std::size_t i = strip_of(rank); i < strips_.size(); ++i) {
    if (strips_[i].log_time < mean - 6 * deviation) break;  // the rest adds less than 1e-10 deviations a rank
    const auto width = static_cast<double>(end_of(i) - std::max(strips_[i].begin, rank));
    growth += width * expected_improvement(strips_[i].log_time, mean, deviation);
  }
  return growth;
}

std::vector<std::size_t> error_ranks(std::span<const double> errors) {
  std::vector<double> distinct(errors.begin(), errors.end());
  std::ranges::sort(distinct);
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  std::vector<std::size_t> ranks;
  for (const double error : errors)
    ranks.push_back(static_cast<std::size_t>(std::ranges::lower_bound(distinct, error) - distinct.begin()));
  return ranks;
}

}  // namespace reliefbench
