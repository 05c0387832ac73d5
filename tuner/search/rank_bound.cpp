#include "tuner/search/rank_bound.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>

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

/// Of the value that has such a tail beyond it, as the share of a sample is uncertain; below 1 where none surely has.
double sure_rank(std::size_t values, double tail) {
  const double expected = tail * static_cast<double>(values);
  return expected - 2 * std::sqrt(expected);
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

double beyond(std::span<const double> values, double tail) {
  const double rank = sure_rank(values.size(), tail);
  if (rank >= 1) return values[static_cast<std::size_t>(rank)];
  return std::max(kLeastBeyond, values.empty() ? 0.0 : kBeyond * values.front());
}

void sort_tail(std::span<double> values, double tail) {
  const auto end = values.begin() + static_cast<std::ptrdiff_t>(std::max(sure_rank(values.size(), tail), 0.0)) + 1;
  if (end >= values.end()) {
    std::ranges::sort(values, std::greater{});
    return;
  }
  std::ranges::nth_element(values, end, std::greater{});
  std::sort(values.begin(), end, std::greater{});
}

}  // namespace reliefbench
