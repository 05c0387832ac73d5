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
constexpr std::array<NullRow, 16> kNullTable{{
    {8, {3.45, 12.66, 33.8, 75.5}},
    {9, {4.57, 15.00, 36.3, 78.3}},
    {10, {5.16, 15.41, 35.7, 77.8}},
    {12, {5.89, 15.84, 33.6, 75.9}},
    {14, {6.28, 15.57, 30.0, 55.5}},
    {17, {6.61, 15.09, 27.2, 44.6}},
    {20, {6.80, 14.81, 25.2, 40.2}},
    {25, {7.03, 14.43, 23.9, 33.6}},
    {32, {7.24, 14.31, 21.7, 30.6}},
    {40, {7.39, 14.19, 21.2, 28.8}},
    {60, {7.68, 14.22, 20.6, 27.3}},
    {80, {7.91, 14.50, 20.7, 27.4}},
    {120, {8.18, 15.08, 20.9, 25.9}},
    {200, {8.67, 16.31, 22.0, 27.2}},
    {300, {9.08, 17.56, 23.3, 27.8}},
    {400, {9.54, 18.65, 24.0, 29.2}},
}};

struct NullQuantiles {
  std::array<double, 4> log_gains;
};

/// Interpolated over log nights; the ends' beyond the ends.
NullQuantiles quantiles(std::size_t nights) {
  const auto above = std::ranges::lower_bound(kNullTable, nights, {}, &NullRow::nights);
  const NullRow& high = above == kNullTable.end() ? kNullTable.back() : *above;
  const NullRow& low = above == kNullTable.begin() || above == kNullTable.end() ? high : *(above - 1);
  const double span = std::log(static_cast<double>(high.nights) / static_cast<double>(low.nights));
  const double share = span > 0 ? std::log(static_cast<double>(nights) / static_cast<double>(low.nights)) / span : 0;
  NullQuantiles result{};
  for (std::size_t i = 0; i < kTableP.size(); ++i)
    result.log_gains[i] = std::lerp(std::log(low.gains[i]), std::log(high.gains[i]), share);
  return result;
}

/// The table's columns between which a value lies, or the last two.
std::size_t column(const auto& is_beyond) {
  std::size_t i = 0;
  while (i + 2 < kTableP.size() && is_beyond(i + 1)) ++i;
  return i;
}

}  // namespace

double null_p(double gain, std::size_t nights) {
  const auto [log_gains] = quantiles(nights);
  const double first = std::exp(log_gains[0]);
  if (gain <= first) return std::lerp(1.0, kTableP[0], std::max(gain, 0.0) / first);
  const double log_gain = std::log(gain);
  const std::size_t i = column([&](std::size_t k) { return log_gain > log_gains[k]; });
  const double share = (log_gain - log_gains[i]) / (log_gains[i + 1] - log_gains[i]);
  return kTableP[i] * std::pow(kTableP[i + 1] / kTableP[i], share);
}

double null_gain(double p, std::size_t nights) {
  const auto [log_gains] = quantiles(nights);
  if (p >= kTableP[0]) return std::exp(log_gains[0]) * (1 - p) / (1 - kTableP[0]);
  const std::size_t i = column([&](std::size_t k) { return p < kTableP[k]; });
  const double share = std::log(p / kTableP[i]) / std::log(kTableP[i + 1] / kTableP[i]);
  return std::exp(std::lerp(log_gains[i], log_gains[i + 1], share));
}

}  // namespace reliefbench
