#include "tuner/results/statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <numeric>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

constexpr double kConfidence = 0.95;        // of summarise()
constexpr double kMadToDeviation = 1.4826;  // of a normal distribution
constexpr double kHuber = 1.5;              // robust standard deviations; 96 % efficient for normal values

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return std::midpoint(*std::max_element(values.begin(), middle), *middle);
}

struct Trim {
  std::size_t each_side = 0;  ///< values to leave out
  double tail = 0;            ///< P(Binomial(n, 1/2) <= each_side): the median is beyond the interval, on one side
};

/// The largest k with 2 P(Binomial(n, 1/2) <= k) <= 1 - confidence, since the median is under the (k+1)-th value iff at
/// most k values are under it. 0 where there is no such k.
Trim trim_of(std::size_t n) {
  double log_p = -static_cast<double>(n) * std::log(2.0);
  Trim trim{.each_side = 0, .tail = std::exp(log_p)};
  for (std::size_t k = 1; k < n; ++k) {
    log_p += std::log(static_cast<double>(n - k + 1) / static_cast<double>(k));
    const double tail = trim.tail + std::exp(log_p);
    if (2 * tail > 1 - kConfidence) break;
    trim = {.each_side = k, .tail = tail};
  }
  return trim;
}

// Derivatives of log gamma: recurrence up to where the asymptotic series [Abramowitz & Stegun 6.3.18, 6.4.12] has ten
// digits.
constexpr double kAsymptotic = 8;

double digamma(double x) {
  double shift = 0;
  while (x < kAsymptotic) shift -= 1 / x++;
  const double i = 1 / (x * x);
  return shift + std::log(x) - 0.5 / x - i * (1.0 / 12 - i * (1.0 / 120 - i / 252));
}

double trigamma(double x) {
  double shift = 0;
  while (x < kAsymptotic) {
    shift += 1 / (x * x);
    ++x;
  }
  const double i = 1 / (x * x);
  return shift + 1 / x + i / 2 + i / x * (1.0 / 6 - i * (1.0 / 30 - i / 42));
}

/// The x in [low, high] where a falling function takes a value; bisected in the logarithm.
template <typename Function>
double solve_falling(double low, double high, double value, const Function& function) {
  constexpr int kHalvings = 100;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(low * high);
    (function(middle) > value ? low : high) = middle;
  }
  return low;
}

double inverse_trigamma(double value) { return solve_falling(1e-6, 1e9, value, trigamma); }

/// Each value's distance to the centre, clipped at the limit; over the share that is not clipped. Sums to what one step
/// moves the centre by, times n.
std::vector<double> clipped(std::span<const double> values, double centre, double limit) {
  std::vector<double> distances;
  double inside = 0;
  for (const double value : values) {
    const double distance = value - centre;
    inside += std::abs(distance) <= limit ? 1 : 0;
    distances.push_back(std::clamp(distance, -limit, limit));
  }
  for (double& distance : distances) distance *= static_cast<double>(values.size()) / std::max(inside, 1.0);
  return distances;
}

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

double median(std::span<const double> values) {
  if (values.empty()) fail_input("median of no values");
  std::vector<double> copy(values.begin(), values.end());
  return median_of(copy);
}

Summary summarise(std::span<const double> values) {
  Summary summary{.median = median(values), .n = static_cast<int>(values.size())};
  std::vector<double> sorted(values.begin(), values.end());
  std::ranges::sort(sorted);
  const std::size_t trimmed = trim_of(sorted.size()).each_side;
  summary.ci_low = sorted[trimmed];
  summary.ci_high = sorted[sorted.size() - 1 - trimmed];
  for (double& value : sorted) value = std::abs(value - summary.median);
  summary.mad = median_of(sorted);
  return summary;
}

double interval_coverage(int n) { return n < 1 ? 0 : 1 - 2 * trim_of(static_cast<std::size_t>(n)).tail; }

std::string coverage_text(int n) {
  return n <= 1 ? fmt::format("{} sample", n) : fmt::format("{:.3g} %", 100 * interval_coverage(n));
}

std::vector<double> holm(std::span<const double> p_values) {
  std::vector<std::size_t> order(p_values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return p_values[i]; });
  std::vector<double> adjusted(p_values.size());
  double running = 0;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    const double scaled = p_values[order[rank]] * static_cast<double>(order.size() - rank);
    running = std::max(running, std::min(1.0, scaled));
    adjusted[order[rank]] = running;
  }
  return adjusted;
}

double geometric_mean(std::span<const double> values) {
  if (values.empty()) fail_input("geometric mean of no values");
  double log_sum = 0;
  for (const double value : values) log_sum += std::log(value);
  return std::exp(log_sum / static_cast<double>(values.size()));
}

// [Abramowitz & Stegun 26.7.3 and 26.7.4]
double df_of_sum(double a, double df_a, double b, double df_b) {
  if (a + b <= 0) return std::max(df_a, 1.0);
  const double parts = (df_a > 0 ? a * a / df_a : 0) + (df_b > 0 ? b * b / df_b : 0);
  return std::clamp((a + b) * (a + b) / parts, 1.0, static_cast<double>(kMostDf));
}

double student_t_p(double t, int df) {
  const int v = std::min(df, kMostDf);
  const double angle = std::atan(std::abs(t) / std::sqrt(v));
  const double cosine = std::cos(angle);
  const bool is_odd = v % 2 == 1;
  double term = is_odd ? cosine : 1;
  double sum = v == 1 ? 0 : term;
  for (int k = is_odd ? 3 : 2; k < v; k += 2) {
    term *= cosine * cosine * (k - 1) / k;
    sum += term;
  }
  sum *= std::sin(angle);
  const double inside = is_odd ? 2 / std::numbers::pi * (angle + sum) : sum;
  return std::max(1 - inside, std::numeric_limits<double>::epsilon());  // what is left of a difference to 1
}

double student_t_quantile(double p, int df) {
  return solve_falling(1e-9, 1e9, p, [df](double t) { return student_t_p(t, df); });
}

Location huber_location(std::span<const double> values) {
  Location location{.value = median(values), .influence = {}};
  std::vector<double> distances;
  for (const double value : values) distances.push_back(std::abs(value - location.value));
  const double limit = kHuber * kMadToDeviation * median_of(distances);
  location.value += mean(clipped(values, location.value, limit));
  location.influence = clipped(values, location.value, limit);
  const double rest = mean(location.influence);
  for (double& one : location.influence) one -= rest;
  return location;
}

double VariancePrior::moderated(double own_variance, double own_df) const {
  if (std::isinf(df)) return variance;
  return (df * variance + own_df * own_variance) / (df + own_df);
}

VariancePrior variance_prior(std::span<const double> variances, std::span<const int> df) {
  std::vector<double> known;
  for (std::size_t i = 0; i < variances.size(); ++i)
    if (df[i] > 0) known.push_back(variances[i]);
  if (known.empty()) return {};
  // A variance of exactly 0 is that of a coarse clock; its logarithm would outweigh all others.
  const double floor = 1e-4 * median_of(known);
  if (floor <= 0) return {.variance = 0, .df = 0};
  std::vector<double> logs;
  double expected = 0;  // scatter of the logs if all variances were one
  for (std::size_t i = 0; i < variances.size(); ++i) {
    if (df[i] <= 0) continue;
    const double half = df[i] / 2.0;
    logs.push_back(std::log(std::max(variances[i], floor)) - digamma(half) + std::log(half));
    expected += trigamma(half);
  }
  const auto n = static_cast<double>(logs.size());
  const double centre = mean(logs);
  double scatter = 0;
  for (const double log : logs) scatter += (log - centre) * (log - centre);
  const double excess = n > 1 ? scatter / (n - 1) - expected / n : 0;
  if (excess <= 0) return {.variance = std::exp(centre), .df = std::numeric_limits<double>::infinity()};
  const double half = inverse_trigamma(excess);
  return {.variance = std::exp(centre + digamma(half) - std::log(half)), .df = 2 * half};
}

}  // namespace reliefbench
