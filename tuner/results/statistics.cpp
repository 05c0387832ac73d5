#include "tuner/results/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <random>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

constexpr double kConfidence = 0.95;     // of summarise()
constexpr std::size_t kExactLimit = 50;  // pooled values up to which Mann-Whitney counts arrangements
constexpr int kBootstrapRounds = 2000;   // enough for a 95 % interval; the end points move by about 1 % of its width
constexpr std::uint64_t kBootstrapSeed = 42;  // fixed: the same samples always give the same interval

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return std::midpoint(*std::max_element(values.begin(), middle), *middle);
}

/// How many values to leave out on either side: the largest k with 2 P(Binomial(n, 1/2) <= k) <= 1 - confidence, since
/// the median is under the (k+1)-th value iff at most k values are under it. 0 where there is no such k.
std::size_t trimmed_each_side(std::size_t n) {
  double log_p = -static_cast<double>(n) * std::log(2.0);
  double tail = 0;
  for (std::size_t k = 0; k < n; ++k) {
    tail += std::exp(log_p);  // P(Binomial <= k)
    if (2 * tail > 1 - kConfidence) return k == 0 ? 0 : k - 1;
    log_p += std::log(static_cast<double>(n - k) / static_cast<double>(k + 1));
  }
  return 0;
}

struct PooledValue {
  double value;
  bool of_a;
};

struct RankSum {
  double u = 0;         // of a: pairs (a, b) with a > b, ties count half
  double tie_term = 0;  // sum of t^3 - t over groups of t equal values
};

RankSum rank_sum(std::span<const double> a, std::span<const double> b) {
  std::vector<PooledValue> pooled;
  pooled.reserve(a.size() + b.size());
  for (const double value : a) pooled.push_back({.value = value, .of_a = true});
  for (const double value : b) pooled.push_back({.value = value, .of_a = false});
  std::ranges::sort(pooled, {}, &PooledValue::value);

  RankSum sum;
  for (std::size_t begin = 0; begin < pooled.size();) {
    std::size_t end = begin;
    std::size_t of_a = 0;
    for (; end < pooled.size() && pooled[end].value == pooled[begin].value; ++end) of_a += pooled[end].of_a ? 1 : 0;
    const auto ties = static_cast<double>(end - begin);
    const double mean_rank = static_cast<double>(begin + 1 + end) / 2;
    sum.u += mean_rank * static_cast<double>(of_a);
    sum.tie_term += ties * ties * ties - ties;
    begin = end;
  }
  const auto n = static_cast<double>(a.size());
  sum.u -= n * (n + 1) / 2;
  return sum;
}

/// P(U <= u) without ties. Counts of arrangements by the recurrence of Mann and Whitney: the largest value is one of
/// a's (then it beats all of b) or one of b's. Exact in double for the sizes that it is used for.
double exact_lower_tail(std::size_t n, std::size_t m, std::size_t u) {
  const std::size_t columns = n * m + 1;
  // counts[i][k]: arrangements of i values of a and (so far) j of b with U = k
  std::vector<std::vector<double>> counts(n + 1, std::vector<double>(columns, 0.0));
  for (auto& row : counts) row[0] = 1;
  for (std::size_t j = 1; j <= m; ++j)
    for (std::size_t i = 1; i <= n; ++i)
      for (std::size_t k = columns; k-- > j;) counts[i][k] += counts[i - 1][k - j];
  const auto& row = counts[n];
  const auto stop = row.begin() + static_cast<std::ptrdiff_t>(std::min(u + 1, columns));
  return std::accumulate(row.begin(), stop, 0.0) / std::accumulate(row.begin(), row.end(), 0.0);
}

/// An index below n that is the same on every standard library (std::uniform_int_distribution is not).
std::size_t random_index(std::mt19937_64& random, std::size_t n) {
  return static_cast<std::size_t>(((random() >> 32U) * static_cast<std::uint64_t>(n)) >> 32U);
}

double resampled_median(std::span<const double> values, std::vector<double>& scratch, std::mt19937_64& random) {
  scratch.resize(values.size());
  for (double& value : scratch) value = values[random_index(random, values.size())];
  return median_of(scratch);
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
  const std::size_t trimmed = trimmed_each_side(sorted.size());
  summary.ci_low = sorted[trimmed];
  summary.ci_high = sorted[sorted.size() - 1 - trimmed];
  for (double& value : sorted) value = std::abs(value - summary.median);
  summary.mad = median_of(sorted);
  return summary;
}

double mann_whitney_p(std::span<const double> a, std::span<const double> b) {
  if (a.empty() || b.empty()) return 1;
  const RankSum sum = rank_sum(a, b);
  const auto n = static_cast<double>(a.size());
  const auto m = static_cast<double>(b.size());
  const double smaller_u = std::min(sum.u, n * m - sum.u);
  if (sum.tie_term == 0 && a.size() + b.size() <= kExactLimit)
    return std::min(1.0, 2 * exact_lower_tail(a.size(), b.size(), static_cast<std::size_t>(smaller_u)));

  const double pooled = n + m;
  const double variance = n * m / 12 * (pooled + 1 - sum.tie_term / (pooled * (pooled - 1)));
  if (variance <= 0) return 1;  // every value is the same
  // Half a step of continuity correction: U moves in steps of one (of a half where there are ties).
  const double z = std::max(0.0, n * m / 2 - smaller_u - 0.5) / std::sqrt(variance);
  return std::erfc(z / std::sqrt(2.0));
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

RatioInterval ratio_interval(std::span<const double> a, std::span<const double> b, double confidence) {
  const double ratio = median(b) / median(a);
  std::mt19937_64 random(kBootstrapSeed);
  std::vector<double> scratch;
  std::vector<double> ratios(static_cast<std::size_t>(kBootstrapRounds));
  for (double& round : ratios) {
    const double base = resampled_median(a, scratch, random);
    round = resampled_median(b, scratch, random) / base;
  }
  std::ranges::sort(ratios);
  const double last = kBootstrapRounds - 1;
  const double tail = std::clamp((1 - confidence) / 2, 0.0, 0.5);
  const auto low = static_cast<std::size_t>(std::floor(tail * last));
  const auto high = static_cast<std::size_t>(std::ceil((1 - tail) * last));
  return {.ratio = ratio, .low = std::min(ratio, ratios[low]), .high = std::max(ratio, ratios[high])};
}

double geometric_mean(std::span<const double> values) {
  if (values.empty()) fail_input("geometric mean of no values");
  double log_sum = 0;
  for (const double value : values) log_sum += std::log(value);
  return std::exp(log_sum / static_cast<double>(values.size()));
}

}  // namespace reliefbench
