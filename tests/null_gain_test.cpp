// The table behind null_gain(): printed by a test that is disabled, and some of its entries made anew.
#include "tuner/decide/null_gain.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <vector>

#include "tests/synthetic_history.h"
#include "tuner/decide/level_fit.h"

namespace reliefbench {
namespace {

constexpr double kTinySigma = 1e-6;

double strongest_null_gain(std::size_t nights, Noise& noise) {
  const std::vector<double> logs = synthetic_history({.nights = nights}, noise);
  std::vector<double> kept;
  for (const std::size_t i : all_but(lone_values(logs, 4, kTinySigma), nights)) kept.push_back(logs[i]);
  return LevelFit(kept, 4, kTinySigma).strongest_gain();
}

/// Largest first.
std::vector<double> null_gains(std::size_t nights, std::size_t trials, std::uint64_t seed) {
  Noise noise(seed);
  std::vector<double> gains;
  for (std::size_t i = 0; i < trials; ++i) gains.push_back(strongest_null_gain(nights, noise));
  std::ranges::sort(gains, std::greater<>());
  return gains;
}

TEST(NullGain, DISABLED_PrintsTheTable) {
  constexpr std::size_t kTrials = 200000;
  for (const std::size_t nights : {8, 9, 10, 12, 14, 17, 20, 25, 32, 40, 60, 80, 120, 200, 300, 400, 600}) {
    const std::vector<double> gains = null_gains(nights, kTrials, nights);
    fmt::print("    {{{}, {{{:.2f}, {:.2f}, {:.1f}, {:.1f}}}}},\n", nights, gains[kTrials / 10], gains[kTrials / 100],
               gains[kTrials / 1000], gains[kTrials / 10000]);
    std::fflush(stdout);
  }
}

// To three standard errors of a share of 4,000: 1.4 % at p = .1, .47 % at .01.
TEST(NullGain, TableIsWhatTrialsGive) {
  constexpr std::size_t kTrials = 4000;
  for (const std::size_t nights : {8, 12, 40, 100}) {
    const std::vector<double> gains = null_gains(nights, kTrials, 1000 + nights);
    for (const double p : {0.1, 0.01}) {
      const auto beyond = std::ranges::count_if(gains, [&](double gain) { return gain > null_gain(p, nights); });
      EXPECT_NEAR(static_cast<double>(beyond) / kTrials, p, p > 0.05 ? 0.014 : 0.0047) << nights << ' ' << p;
    }
  }
}

TEST(NullGain, PAndGainAreInverse) {
  for (const std::size_t nights : {3, 8, 11, 120, 5000})
    for (const double p : {0.9, 0.3, 0.1, 0.05, 1e-2, 5e-4, 1e-4, 1e-9})
      EXPECT_NEAR(null_p(null_gain(p, nights), nights) / p, 1, 1e-9) << nights << ' ' << p;
}

TEST(NullGain, MoreGainIsLessLikely) {
  for (const std::size_t nights : {8, 30, 120, 400}) {
    double before = 1;
    for (double gain = 0.5; gain < 500; gain *= 1.2) {
      EXPECT_LT(null_p(gain, nights), before);
      before = null_p(gain, nights);
    }
  }
}

}  // namespace
}  // namespace reliefbench
