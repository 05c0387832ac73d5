#include "tuner/search/rank_bound.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace reliefbench {
namespace {

/// log P(a binomial variable of so many trials is at least `least`)
double log_upper_tail(int trials, int least, double log_chance) {
  const double log_other = std::log1p(-std::exp(log_chance));
  double most = -1e300;
  double sum = 0;
  for (int hits = least; hits <= trials; ++hits) {
    const double log_ways = std::lgamma(trials + 1.0) - std::lgamma(hits + 1.0) - std::lgamma(trials - hits + 1.0);
    const double term = log_ways + hits * log_chance + (hits < trials ? (trials - hits) * log_other : 0);
    sum = term > most ? sum * std::exp(most - term) + 1 : sum + std::exp(term - most);
    most = std::max(most, term);
  }
  return most + std::log(sum);
}

}  // namespace

std::array<double, kMostRanked> tails_for(double log_alpha) {
  std::array<double, kMostRanked> tails{};
  for (int count = 1; count <= kMostRanked; ++count) {
    // 1/2 + 1/6 + 1/12 + ... = 1. Only the prone settings need the bound.
    const double target = std::log(kProne) - log_alpha - std::log(count * (count + 1.0));
    double low = std::min(target, -1e-11);
    double high = -1e-12;
    for (int step = 0; step < 50; ++step) {
      const double middle = (low + high) / 2;
      (log_upper_tail(count, count - rank_of(count) + 1, middle) > target ? high : low) = middle;
    }
    tails[static_cast<std::size_t>(count) - 1] = std::exp(low) / kProne;
  }
  return tails;
}

double beyond(std::span<const double> falling, double tail) {
  const double expected = tail * static_cast<double>(falling.size());
  const double surely = expected - 2 * std::sqrt(expected);  // the share of a sample is uncertain
  if (surely >= 1) return falling[static_cast<std::size_t>(surely)];
  return std::max(kLeastBeyond, falling.empty() ? 0.0 : kBeyond * falling.front());
}

}  // namespace reliefbench
