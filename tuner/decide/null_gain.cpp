#include "tuner/decide/null_gain.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace reliefbench {
namespace {

constexpr std::array<double, 4> kTableP{0.1, 0.01, 0.001, 0.0001};

struct NullRow {
  std::size_t nights;
  std::array<double, 4> gains;  // exceeded with kTableP
};

// Printed by reliefbench_tests --gtest_also_run_disabled_tests --gtest_filter=NullGain.DISABLED_PrintsTheTable
// (tests/null_gain_test.cpp): 200,000 series a row, seed = nights.
constexpr std::array<NullRow, 17> kNullTable{{
    {8, {3.34, 12.27, 32.6, 74.5}},
    {9, {4.41, 14.53, 35.5, 74.9}},
    {10, {4.98, 14.87, 34.1, 74.3}},
    {12, {5.67, 15.26, 32.2, 73.8}},
    {14, {6.03, 14.98, 28.9, 54.1}},
    {17, {6.33, 14.47, 26.0, 43.6}},
    {20, {6.52, 14.17, 24.3, 38.2}},
    {25, {6.73, 13.84, 22.9, 33.1}},
    {32, {6.93, 13.73, 21.0, 30.0}},
    {40, {7.09, 13.59, 20.3, 28.2}},
    {60, {7.38, 13.66, 20.0, 26.9}},
    {80, {7.59, 13.93, 19.9, 26.5}},
    {120, {7.88, 14.53, 20.3, 25.3}},
    {200, {8.36, 15.70, 21.4, 26.0}},
    {300, {8.77, 16.98, 22.7, 26.9}},
    {400, {9.22, 18.07, 23.5, 28.7}},
    {600, {10.06, 19.41, 24.2, 28.6}},
}};

/// Logarithms of the gains, interpolated over log nights; the ends' beyond the ends.
std::array<double, 4> log_quantiles(std::size_t nights) {
  const auto above = std::ranges::lower_bound(kNullTable, nights, {}, &NullRow::nights);
  const NullRow& high = above == kNullTable.end() ? kNullTable.back() : *above;
  const NullRow& low = above == kNullTable.begin() || above == kNullTable.end() ? high : *(above - 1);
  const double span = std::log(static_cast<double>(high.nights) / static_cast<double>(low.nights));
  const double share = span > 0 ? std::log(static_cast<double>(nights) / static_cast<double>(low.nights)) / span : 0;
  std::array<double, 4> result{};
  for (std::size_t i = 0; i < kTableP.size(); ++i)
    result[i] = std::lerp(std::log(low.gains[i]), std::log(high.gains[i]), share);
  return result;
}

/// The table's columns between which a value lies, or the last two.
std::size_t bracket(const auto& is_beyond) {
  std::size_t i = 0;
  while (i + 2 < kTableP.size() && is_beyond(i + 1)) ++i;
  return i;
}

}  // namespace

double null_p(double gain, std::size_t nights) {
  const std::array<double, 4> log_gains = log_quantiles(nights);
  const double first = std::exp(log_gains[0]);
  if (gain <= first) return std::lerp(1.0, kTableP[0], std::max(gain, 0.0) / first);
  const double log_gain = std::log(gain);
  const std::size_t i = bracket([&](std::size_t k) { return log_gain > log_gains[k]; });
  const double share = (log_gain - log_gains[i]) / (log_gains[i + 1] - log_gains[i]);
  return kTableP[i] * std::pow(kTableP[i + 1] / kTableP[i], share);
}

double null_gain(double p, std::size_t nights) {
  const std::array<double, 4> log_gains = log_quantiles(nights);
  if (p >= kTableP[0]) return std::exp(log_gains[0]) * (1 - p) / (1 - kTableP[0]);
  const std::size_t i = bracket([&](std::size_t k) { return p < kTableP[k]; });
  const double share = std::log(p / kTableP[i]) / std::log(kTableP[i + 1] / kTableP[i]);
  return std::exp(std::lerp(log_gains[i], log_gains[i + 1], share));
}

}  // namespace reliefbench
