#include "tuner/results/statistics.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

std::vector<double> one_to(int n) {
  std::vector<double> values(static_cast<std::size_t>(n));
  std::iota(values.begin(), values.end(), 1.0);
  return values;
}

/// 1 to 12 positive values without ties.
std::vector<double> distinct_times() {
  auto ints = *rc::gen::suchThat(rc::gen::unique<std::vector<int>>(rc::gen::inRange(1, 100000)),
                                 [](const auto& v) { return !v.empty(); });
  return {ints.begin(), ints.begin() + static_cast<std::ptrdiff_t>(std::min(ints.size(), std::size_t{12}))};
}

TEST(Statistics, MedianOfOddAndEvenCounts) {
  EXPECT_EQ(median(std::vector{3.0, 1.0, 2.0}), 2);
  EXPECT_EQ(median(std::vector{4.0, 1.0, 3.0, 2.0}), 2.5);
  EXPECT_EQ(median(std::vector{7.0}), 7);
  EXPECT_THROW((void)median({}), Error);
}

TEST(Statistics, MedianAbsoluteDeviation) {
  const Summary summary = summarise(std::vector{1.0, 1.0, 2.0, 2.0, 4.0, 6.0, 9.0});  // the textbook example
  EXPECT_EQ(summary.median, 2);
  EXPECT_EQ(summary.mad, 1);
  EXPECT_EQ(summary.n, 7);
}

// Ranks from the published tables of the sign-test interval of a median, 95 %.
TEST(Statistics, OrderStatisticIntervalMatchesTheTables) {
  struct Row {
    int n, low, high;
  };
  for (const Row row : {Row{6, 1, 6}, Row{8, 1, 8}, Row{9, 2, 8}, Row{10, 2, 9}, Row{15, 4, 12}, Row{20, 6, 15},
                        Row{30, 10, 21}, Row{100, 40, 61}}) {
    const Summary summary = summarise(one_to(row.n));
    EXPECT_EQ(summary.ci_low, row.low) << row.n;
    EXPECT_EQ(summary.ci_high, row.high) << row.n;
  }
}

TEST(Statistics, FewValuesGiveTheWholeRange) {
  for (int n = 1; n <= 5; ++n) {
    const Summary summary = summarise(one_to(n));
    EXPECT_EQ(summary.ci_low, 1);
    EXPECT_EQ(summary.ci_high, n);
  }
}

TEST(Statistics, IntervalOfManyValuesStaysFinite) {
  const Summary summary = summarise(one_to(5000));  // 2^-5000 is no double
  EXPECT_NEAR(summary.ci_low, 2500 - 1.96 * std::sqrt(5000.0) / 2, 2);
  EXPECT_EQ(summary.ci_low + summary.ci_high, 5001);
}

RC_GTEST_PROP(Statistics, IntervalHoldsTheMedian, ()) {
  const auto values = distinct_times();
  const Summary summary = summarise(values);
  RC_ASSERT(summary.ci_low <= summary.median);
  RC_ASSERT(summary.median <= summary.ci_high);
  RC_ASSERT(summary.mad >= 0);
  RC_ASSERT(std::ranges::find(values, summary.ci_low) != values.end());
}

// 2 / C(n + m, n) arrangements are as extreme as complete separation.
TEST(Statistics, MannWhitneyOfSeparatedSamplesByHand) {
  EXPECT_NEAR(mann_whitney_p(std::vector{1.0, 2.0, 3.0}, std::vector{4.0, 5.0, 6.0}), 2.0 / 20, 1e-15);
  EXPECT_NEAR(mann_whitney_p(one_to(5), std::vector{11.0, 12.0, 13.0, 14.0, 15.0}), 2.0 / 252, 1e-15);
  EXPECT_NEAR(mann_whitney_p(std::vector{1.0, 2.0, 4.0}, std::vector{3.0, 5.0, 6.0}), 4.0 / 20, 1e-15);
  EXPECT_EQ(mann_whitney_p(std::vector{1.0, 4.0}, std::vector{2.0, 3.0}), 1);
}

// U = 3 (n = 4, m = 5): 2 * 7 / 126 by the table of Mann and Whitney (1947); the critical values of the usual table
// (n = m = 10: U = 23 at 0.05).
TEST(Statistics, MannWhitneyMatchesTheTables) {
  EXPECT_NEAR(mann_whitney_p(std::vector{1.0, 2.0, 3.0, 7.5}, std::vector{4.0, 5.0, 6.0, 8.0, 9.0}), 2.0 * 7 / 126,
              1e-15);
  const auto p_of_u = [](int u) {  // a = 1..9 and one value above u of b's ten
    std::vector<double> a = one_to(10);
    std::vector<double> b;
    for (int i = 0; i < 10; ++i) b.push_back(100.0 + i);
    for (int moved = 0; moved < u / 10; ++moved) a[static_cast<std::size_t>(moved)] = 200.0 + moved;
    a[9] = 99.5 + u % 10;
    return mann_whitney_p(a, b);
  };
  EXPECT_LE(p_of_u(23), 0.05);
  EXPECT_GT(p_of_u(24), 0.05);
}

// By hand: ranks 1.5 1.5 3.5 5 | 3.5 6.5 6.5 8, U = 1.5, tie term 3 * 6 = 18, variance 12 * (1 - 18/504).
TEST(Statistics, MannWhitneyWithTiesUsesTheCorrectedNormal) {
  const std::vector a{1.0, 1.0, 2.0, 3.0};
  const std::vector b{2.0, 4.0, 4.0, 5.0};
  const double z = (8 - 1.5 - 0.5) / std::sqrt(12 * (1 - 18.0 / 504));
  EXPECT_NEAR(mann_whitney_p(a, b), std::erfc(z / std::sqrt(2.0)), 1e-12);
  EXPECT_EQ(mann_whitney_p(std::vector{2.0, 2.0}, std::vector{2.0, 2.0}), 1);
  EXPECT_EQ(mann_whitney_p({}, b), 1);
}

TEST(Statistics, ExactAndNormalAgreeWhereTheyMeet) {
  std::vector<double> a;
  std::vector<double> b;
  for (int i = 0; i < 25; ++i) {
    a.push_back(2.0 * i);
    b.push_back(2.0 * i + 17);
  }
  const double exact = mann_whitney_p(a, b);
  a.push_back(1000);  // one value more on either side: over the limit of the exact count
  b.push_back(1001);
  EXPECT_NEAR(exact, mann_whitney_p(a, b), 0.02);
}

RC_GTEST_PROP(Statistics, MannWhitneyIsSymmetricAndAProbability, ()) {
  const auto a =
      *rc::gen::container<std::vector<double>>(rc::gen::map(rc::gen::inRange(0, 30), [](int i) { return i * 1.0; }));
  const auto b =
      *rc::gen::container<std::vector<double>>(rc::gen::map(rc::gen::inRange(0, 30), [](int i) { return i * 1.0; }));
  const double p = mann_whitney_p(a, b);
  RC_ASSERT(p > 0 && p <= 1);
  RC_ASSERT(std::abs(p - mann_whitney_p(b, a)) < 1e-12);
}

TEST(Statistics, HolmByHand) {
  const auto adjusted = holm(std::vector{0.01, 0.04, 0.03, 0.005});  // the usual worked example
  const std::vector expected{0.03, 0.06, 0.06, 0.02};
  ASSERT_EQ(adjusted.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(adjusted[i], expected[i], 1e-15) << i;
  EXPECT_TRUE(holm({}).empty());
}

RC_GTEST_PROP(Statistics, HolmKeepsTheOrderAndOnlyRaises, ()) {
  const auto p = *rc::gen::container<std::vector<double>>(
      rc::gen::map(rc::gen::inRange(0, 1001), [](int i) { return i / 1000.0; }));
  const auto adjusted = holm(p);
  for (std::size_t i = 0; i < p.size(); ++i) {
    RC_ASSERT(adjusted[i] >= p[i] && adjusted[i] <= 1);
    for (std::size_t j = 0; j < p.size(); ++j) RC_ASSERT(p[i] >= p[j] || adjusted[i] <= adjusted[j]);
  }
}

TEST(Statistics, RatioOfConstantSamplesIsCertain) {
  const RatioInterval interval = ratio_interval(std::vector(7, 2.0), std::vector(5, 3.0), 0.95);
  EXPECT_EQ(interval.ratio, 1.5);
  EXPECT_EQ(interval.low, 1.5);
  EXPECT_EQ(interval.high, 1.5);
}

TEST(Statistics, RatioIntervalCoversTheTruthAboutAsOftenAsItSays) {
  std::uint32_t state = 1;  // a small generator of our own: the same samples on every machine
  const auto noise = [&] {
    double sum = 0;
    for (int i = 0; i < 12; ++i) sum += ((state = state * 1664525U + 1013904223U) >> 8U) / 16777216.0;
    return sum - 6;
  };
  int covered = 0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> a;
    std::vector<double> b;
    for (int i = 0; i < 21; ++i) a.push_back(100 + 5 * noise());
    for (int i = 0; i < 21; ++i) b.push_back(110 + 5 * noise());
    const RatioInterval interval = ratio_interval(a, b, 0.95);
    covered += interval.low <= 1.1 && 1.1 <= interval.high ? 1 : 0;
  }
  EXPECT_GT(covered, kTrials * 88 / 100);
  EXPECT_LT(covered, kTrials);
}

RC_GTEST_PROP(Statistics, RatioIntervalHoldsTheRatioAndRepeats, ()) {
  const auto a = distinct_times();
  const auto b = distinct_times();
  const RatioInterval interval = ratio_interval(a, b, 0.9);
  RC_ASSERT(interval.low <= interval.ratio && interval.ratio <= interval.high);
  RC_ASSERT(interval.ratio == median(b) / median(a));
  const RatioInterval wider = ratio_interval(a, b, 0.99);
  RC_ASSERT(wider.low <= interval.low && wider.high >= interval.high);
  RC_ASSERT(ratio_interval(a, b, 0.9).low == interval.low);
}

TEST(Statistics, GeometricMean) {
  EXPECT_NEAR(geometric_mean(std::vector{2.0, 0.5}), 1, 1e-15);
  EXPECT_NEAR(geometric_mean(std::vector{1.0, 10.0, 100.0}), 10, 1e-12);
  EXPECT_THROW((void)geometric_mean({}), Error);
}

}  // namespace
}  // namespace reliefbench
