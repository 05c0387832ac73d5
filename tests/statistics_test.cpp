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

// 1 - 2 P(Binomial(n, 1/2) <= values left out on either side), by hand.
TEST(Statistics, CoverageIsWhatTheIntervalHas) {
  EXPECT_NEAR(interval_coverage(3), 0.75, 1e-12);
  EXPECT_NEAR(interval_coverage(5), 1 - 2.0 / 32, 1e-12);
  EXPECT_NEAR(interval_coverage(6), 1 - 2.0 / 64, 1e-12);
  EXPECT_NEAR(interval_coverage(7), 1 - 2.0 / 128, 1e-12);
  EXPECT_NEAR(interval_coverage(10), 1 - 2.0 * (1 + 10) / 1024, 1e-12);
  EXPECT_EQ(interval_coverage(1), 0);
  EXPECT_EQ(interval_coverage(0), 0);
  for (const int n : {20, 100, 5000}) {
    EXPECT_GE(interval_coverage(n), 0.95) << n;
    EXPECT_LT(interval_coverage(n), 0.97) << n;
  }
  EXPECT_EQ(coverage_text(10), "97.9 %");
  EXPECT_EQ(coverage_text(5), "93.8 %");
  EXPECT_EQ(coverage_text(3), "75 %");
  EXPECT_EQ(coverage_text(1), "1 sample");
}

/// Uniform in (0, 1): a small generator of our own, the same on every machine.
class Uniform {
 public:
  double operator()() { return (((state_ = state_ * 1664525U + 1013904223U) >> 8U) + 0.5) / 16777216.0; }

 private:
  std::uint32_t state_ = 1;
};

TEST(Statistics, CoverageHoldsInTrials) {
  Uniform uniform;
  for (const int n : {3, 5, 7, 10}) {
    int covered = 0;
    constexpr int kTrials = 4000;
    for (int trial = 0; trial < kTrials; ++trial) {
      std::vector<double> values;
      for (int i = 0; i < n; ++i) values.push_back(uniform() * uniform());  // skewed; its median is 0.18668
      const Summary summary = summarise(values);
      covered += summary.ci_low <= 0.18668 && 0.18668 <= summary.ci_high ? 1 : 0;
    }
    EXPECT_NEAR(covered / double{kTrials}, interval_coverage(n), 0.02) << n;
  }
}

// The usual table of Student's t.
TEST(Statistics, StudentsTMatchesTheTables) {
  struct Row {
    int df;
    double p, t;
  };
  for (const Row row : {Row{1, 0.05, 12.706}, Row{2, 0.05, 4.303}, Row{3, 0.01, 5.841}, Row{5, 0.05, 2.571},
                        Row{10, 0.05, 2.228}, Row{12, 0.001, 4.318}, Row{18, 0.05, 2.101}, Row{60, 0.01, 2.660}}) {
    EXPECT_NEAR(student_t_quantile(row.p, row.df), row.t, 5e-4 * row.t) << row.df;
    EXPECT_NEAR(student_t_p(-row.t, row.df), row.p, 2e-3 * row.p) << row.df;
  }
  EXPECT_EQ(student_t_p(0, 7), 1);
  EXPECT_GT(student_t_p(1e9, 50), 0);
}

TEST(Statistics, HuberLocationIsTheMeanWithoutOutliersAndHardlyMovesWithThem) {
  const std::vector<double> plain = one_to(9);
  EXPECT_NEAR(huber_location(plain).value, 5, 1e-12);
  std::vector<double> with_outlier = plain;
  with_outlier[8] = 1000;
  EXPECT_NEAR(huber_location(with_outlier).value, 5.2, 0.6);
  EXPECT_EQ(huber_location(std::vector{2.0, 2.0, 2.0, 7.0}).value, 2);  // MAD 0
  EXPECT_EQ(huber_location(std::vector{4.0}).value, 4);
  EXPECT_NEAR(std::accumulate(plain.begin(), plain.end(), 0.0) / 9, huber_location(plain).value, 1e-12);
}

RC_GTEST_PROP(Statistics, HuberInfluencesSumToNothingAndLocationIsAmongTheValues, ()) {
  const auto values = distinct_times();
  const Location location = huber_location(values);
  RC_ASSERT(location.influence.size() == values.size());
  const double scale = *std::ranges::max_element(values);
  RC_ASSERT(std::abs(std::accumulate(location.influence.begin(), location.influence.end(), 0.0)) < 1e-9 * scale);
  RC_ASSERT(location.value >= *std::ranges::min_element(values) && location.value <= scale);
}

TEST(Statistics, VariancesThatMayBeOneArePooledAndOthersKeepTheirOwn) {
  const std::vector<int> df(200, 9);
  Uniform uniform;
  std::vector<double> alike;
  std::vector<double> unlike;
  for (int i = 0; i < 200; ++i) {
    double sum = 0;  // of nine squares of normals, each from twelve uniforms
    for (int k = 0; k < 9; ++k) {
      double normal = -6;
      for (int j = 0; j < 12; ++j) normal += uniform();
      sum += normal * normal;
    }
    alike.push_back(sum / 9);
    unlike.push_back(sum / 9 * std::exp(6 * uniform()));
  }
  const VariancePrior one = variance_prior(alike, df);
  EXPECT_NEAR(one.variance, 1, 0.1);
  EXPECT_GT(one.df, 40);
  EXPECT_NEAR(one.moderated(4, 9), 1, 0.7);
  const VariancePrior many = variance_prior(unlike, df);
  EXPECT_LT(many.df, 3);
  EXPECT_NEAR(many.moderated(400, 9), 400, 200);
  EXPECT_EQ(variance_prior(std::vector<double>{}, std::vector<int>{}).df, 0);
  EXPECT_EQ(variance_prior(std::vector{1.0}, std::vector{0}).df, 0);
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

TEST(Statistics, GeometricMean) {
  EXPECT_NEAR(geometric_mean(std::vector{2.0, 0.5}), 1, 1e-15);
  EXPECT_NEAR(geometric_mean(std::vector{1.0, 10.0, 100.0}), 10, 1e-12);
  EXPECT_THROW((void)geometric_mean({}), Error);
}

}  // namespace
}  // namespace reliefbench
