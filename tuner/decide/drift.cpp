#include "tuner/decide/drift.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr double kMostTrendRho = 0.95;

std::vector<double> rest_about_line(std::span<const std::size_t> nights, std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  double night = 0;
  double value = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    night += static_cast<double>(nights[i]) / n;
    value += values[i] / n;
  }
  double products = 0;
  double squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double x = static_cast<double>(nights[i]) - night;
    products += x * (values[i] - value);
    squares += x * x;
  }
  const double slope = squares > 0 ? products / squares : 0;
  std::vector<double> rest;
  for (std::size_t i = 0; i < values.size(); ++i)
    rest.push_back(values[i] - value - slope * (static_cast<double>(nights[i]) - night));
  return rest;
}

/// Of what is left about a line, its bias taken off as of values that lost two means.
double trend_rho(std::span<const double> rest) {
  const auto n = static_cast<double>(rest.size());
  const double squares = std::inner_product(rest.begin(), rest.end(), rest.begin(), 0.0);
  const double products = std::inner_product(rest.begin() + 1, rest.end(), rest.begin(), 0.0);
  return squares > 0 ? std::clamp((n * products / squares + 2) / (n - 4), 0.0, kMostTrendRho) : 0;
}

/// Variance of Kendall's sum. Ties would make it less.
double kendall_variance(std::size_t count, double rho) {
  const auto n = static_cast<double>(count);
  double inflation = 1;
  double power = 1;
  for (std::size_t lag = 1; lag + 2 < count && power > 1e-6; ++lag) {
    power *= rho;
    const double left = n - static_cast<double>(lag);
    inflation += 2 * left * (left - 1) * (left - 2) * power / (n * (n - 1) * (n - 2));
  }
  return n * (n - 1) * (2 * n + 5) / 18 * inflation;
}

/// Pairs that rise less those that fall.
double kendall_sum(std::span<const double> values) {
  int sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    for (std::size_t j = i + 1; j < values.size(); ++j)
      sum += static_cast<int>(values[j] > values[i]) - static_cast<int>(values[j] < values[i]);
  return sum;
}

/// Of every pair.
std::vector<double> pair_slopes(std::span<const std::size_t> nights, std::span<const double> values) {
  std::vector<double> slopes;
  slopes.reserve(values.size() * (values.size() - 1) / 2);
  for (std::size_t i = 0; i < values.size(); ++i)
    for (std::size_t j = i + 1; j < values.size(); ++j)
      slopes.push_back((values[j] - values[i]) / static_cast<double>(nights[j] - nights[i]));
  return slopes;
}

/// What would stand at these ranks, which rise, if values were sorted.
template <std::size_t kCount>
std::array<double, kCount> ranked(std::vector<double> values, const std::array<double, kCount>& ranks) {
  std::array<double, kCount> found{};
  auto first = values.begin();
  for (std::size_t i = 0; i < kCount; ++i) {
    const double rank = std::clamp(ranks[i], 0.0, static_cast<double>(values.size() - 1));
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(first, place, values.end());
    found[i] = *place;
    first = place;
  }
  return found;
}

}  // namespace

double squares_about_line(std::span<const std::size_t> nights, std::span<const double> values) {
  const std::vector<double> rest = rest_about_line(nights, values);
  return std::inner_product(rest.begin(), rest.end(), rest.begin(), 0.0);
}

std::optional<Drift> find_drift(std::span<const std::size_t> nights, std::span<const double> values, double most_p,
                                double confidence) {
  if (values.size() < 10) return {};
  const double sum = kendall_sum(values);
  const double deviation = std::sqrt(kendall_variance(values.size(), trend_rho(rest_about_line(nights, values))));
  const double z = std::max(std::abs(sum) - 1, 0.0) / deviation;
  const double p = std::erfc(z / std::numbers::sqrt2);
  if (p > most_p) return {};
  std::vector<double> slopes = pair_slopes(nights, values);
  const double middle = static_cast<double>(slopes.size() - 1) / 2;
  const double margin = student_t_quantile(1 - confidence, kMostDf) * deviation / 2;
  const auto [low, below, above, high] = ranked<4>(std::move(slopes), {std::floor(middle - margin), std::floor(middle),
                                                                       std::ceil(middle), std::ceil(middle + margin)});
  return Drift{.log_ratio_per_night = 0.5 * (below + above), .low = low, .high = high, .p = p};
}

}  // namespace reliefbench
