#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "kernels/base/error.h"
#include "tuner/search/gaps.h"
#include "tuner/search/improvement.h"
#include "tuner/search/likelihood.h"
#include "tuner/search/loops.h"
#include "tuner/search/observations.h"
#include "tuner/search/random.h"
#include "tuner/search/recorded_table.h"
#include "tuner/search/rivals.h"
#include "tuner/search/surrogate.h"

namespace reliefbench {
namespace {

double median_of_three(double a, double b, double c) { return std::max(std::min(a, b), std::min(std::max(a, b), c)); }

RC_GTEST_PROP(MeanMedian, is_the_mean_over_all_triples, ()) {
  auto values = *rc::gen::resize(12, rc::gen::container<std::vector<int>>(rc::gen::inRange(-50, 50)));
  while (values.size() < 3) values.push_back(static_cast<int>(values.size()));
  std::vector<double> sorted(values.begin(), values.end());
  std::ranges::sort(sorted);
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i)
    for (std::size_t j = i + 1; j < sorted.size(); ++j)
      for (std::size_t k = j + 1; k < sorted.size(); ++k, ++count) sum += sorted[j];
  RC_ASSERT(std::abs(mean_median(sorted, sorted.front(), sorted.back()) - sum / count) < 1e-9);
}

TEST(TrueLogTime, is_the_mean_over_all_draws) {
  const std::vector<double> samples{5, 1, 4, 1, 9};
  double sum = 0;
  for (const double a : samples)
    for (const double b : samples)
      for (const double c : samples) sum += std::log(median_of_three(a, b, c));
  EXPECT_NEAR(true_log_time(samples), sum / 125, 1e-12);
  EXPECT_THROW((void)true_log_time({}), Error);
}

RecordedTable one_setting() {
  RecordedTable table;
  table.space.candidates.push_back({.id = "a", .categories = {}, .steps = {}});
  table.samples = {{100, 101, 99, 100, 102, 98, 100, 103, 170, 97}};
  return table;
}

// Block means are (1 + 2 rho) / 3 as variable as frames.
TEST(ReplaySource, frames_of_a_block_are_correlated_and_each_is_distributed_as_recorded) {
  const RecordedTable table = one_setting();
  for (const double correlation : {0.0, 0.31, 0.65, 1.0}) {
    ReplaySource times(table, 7, correlation);
    constexpr int kBlocks = 20000;
    double sum = 0;
    double squares = 0;
    double block_squares = 0;
    int slow = 0;
    for (int block = 0; block < kBlocks; ++block) {
      double mean = 0;
      for (int i = 0; i < kBlock; ++i) {
        const double frame = times.frame_ns(0, block * kBlock + i);
        sum += frame;
        squares += frame * frame;
        mean += frame / kBlock;
        slow += frame > 150 ? 1 : 0;
      }
      block_squares += mean * mean;
    }
    const double mean = sum / (kBlocks * kBlock);
    const double variance = squares / (kBlocks * kBlock) - mean * mean;
    const double of_means = block_squares / kBlocks - mean * mean;
    EXPECT_NEAR(of_means / variance, (1 + 2 * correlation) / 3, 0.02) << correlation;
    EXPECT_NEAR(slow / static_cast<double>(kBlocks * kBlock), 0.1, 0.006) << correlation;
  }
}

struct RankedTime {
  std::size_t rank;
  double log_time;
};

std::vector<RankedTime> random_points(Random& random, std::size_t ranks) {
  std::vector<RankedTime> points(random.below(8));
  for (RankedTime& point : points)
    point = {.rank = static_cast<std::size_t>(random.below(ranks)), .log_time = static_cast<double>(random.below(9))};
  return points;
}

double brute_volume(const std::vector<RankedTime>& points, std::size_t ranks, double reference) {
  double area = 0;
  for (std::size_t rank = 0; rank < ranks; ++rank) {
    double best = reference;
    for (const RankedTime& point : points) {
      if (point.rank <= rank) best = std::min(best, point.log_time);
    }
    area += reference - best;
  }
  return area;
}

TEST(Staircase, hypervolume_agrees_with_brute_force) {
  Random random(1);
  for (int round = 0; round < 500; ++round) {
    const std::vector<RankedTime> points = random_points(random, 10);
    Staircase front(10, 7);
    for (const RankedTime& point : points) front.add(point.rank, point.log_time);
    EXPECT_NEAR(front.hypervolume(), brute_volume(points, 10, 7), 1e-9);
  }
}

TEST(Staircase, expected_growth_agrees_with_an_integral_over_the_time) {
  Random random(2);
  for (int round = 0; round < 50; ++round) {
    std::vector<RankedTime> points = random_points(random, 10);
    Staircase front(10, 7);
    for (const RankedTime& point : points) front.add(point.rank, point.log_time);
    const auto rank = static_cast<std::size_t>(random.below(10));
    const double mean = 8 * random.uniform();
    const double deviation = 0.2 + random.uniform();
    const double before = brute_volume(points, 10, 7);
    double expected = 0;
    constexpr int kSteps = 4000;
    points.push_back({.rank = rank, .log_time = 0});
    for (int i = 0; i < kSteps; ++i) {
      const double z = -7 + 14 * (i + 0.5) / kSteps;
      points.back().log_time = mean + deviation * z;
      expected += std::exp(-z * z / 2) / std::sqrt(2 * M_PI) * 14 / kSteps * (brute_volume(points, 10, 7) - before);
    }
    EXPECT_NEAR(front.expected_growth(rank, mean, deviation), expected, 1e-3);
  }
}

TEST(ExpectedImprovement, without_doubt_is_the_gain) {
  EXPECT_EQ(expected_improvement(3, 1, 0), 2);
  EXPECT_EQ(expected_improvement(1, 3, 0), 0);
}

/// Gap of one budget by its definition.
double brute_gap(const SearchSpace& space, const std::vector<double>& lower, const std::vector<double>& upper,
                 double budget) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::size_t pick = space.candidates.size();
  for (std::size_t i = 0; i < space.candidates.size(); ++i) {
    if (space.candidates[i].error > budget || !space.candidates[i].is_feasible) continue;
    if (pick == space.candidates.size() || upper[i] < upper[pick]) pick = i;
  }
  if (pick == space.candidates.size() || upper[pick] == kInfinity) return kInfinity;
  double gap = 0;
  for (std::size_t i = 0; i < space.candidates.size(); ++i) {
    if (i == pick || space.candidates[i].error > budget || !space.candidates[i].is_feasible) continue;
    gap = std::max(gap, upper[pick] - lower[i]);
  }
  return gap;
}

TEST(Gaps, agree_with_brute_force) {
  Random random(3);
  for (int round = 0; round < 500; ++round) {
    SearchSpace space;
    std::vector<double> lower;
    std::vector<double> upper;
    const std::size_t settings = 1 + random.below(7);
    for (std::size_t i = 0; i < settings; ++i) {
      space.candidates.push_back({.id = std::to_string(i),
                                  .categories = {},
                                  .steps = {},
                                  .error = static_cast<double>(random.below(5)),
                                  .is_feasible = i == 0 || random.below(4) > 0});
      lower.push_back(random.uniform());
      upper.push_back(random.below(5) == 0 ? std::numeric_limits<double>::infinity() : lower.back() + random.uniform());
    }
    Gaps gaps(space);
    double widest = 0;
    for (std::size_t i = 0; i < settings; ++i) {
      if (!space.candidates[i].is_feasible) continue;
      gaps.set(i, lower[i], upper[i]);
      widest = std::max(widest, brute_gap(space, lower, upper, space.candidates[i].error));
    }
    EXPECT_EQ(gaps.widest().log_gap, widest);
    const double narrow = std::min(widest / 2, 10.0);
    const std::vector<WideGap> wide = gaps.wider_than(narrow, 3);
    EXPECT_EQ(wide.empty(), widest == 0);
    if (!wide.empty()) {
      EXPECT_EQ(wide.front().log_gap, widest);
    }
    for (const WideGap& gap : wide) {
      EXPECT_GT(gap.log_gap, narrow);
      EXPECT_EQ(gap.log_gap, brute_gap(space, lower, upper, gap.budget));
    }
    for (const Gaps::Answer& answer : gaps.answers())
      EXPECT_GE(answer.log_gap, brute_gap(space, lower, upper, space.candidates[answer.pick].error));
  }
}

TEST(NonDominatedSort, agrees_with_peeling_by_definition) {
  Random random(4);
  for (int round = 0; round < 200; ++round) {
    std::vector<double> error;
    std::vector<double> time;
    for (std::uint64_t i = 0; i < 1 + random.below(9); ++i) {
      error.push_back(static_cast<double>(random.below(5)));
      time.push_back(static_cast<double>(random.below(5)));
    }
    const std::vector<Ranked> ranked = non_dominated_sort(error, time);
    const auto dominates = [&](std::size_t a, std::size_t b) {
      return error[a] <= error[b] && time[a] <= time[b] && (error[a] < error[b] || time[a] < time[b]);
    };
    for (std::size_t i = 0; i < error.size(); ++i) {
      int front = 0;
      for (std::size_t j = 0; j < error.size(); ++j) {
        if (dominates(j, i)) front = std::max(front, ranked[j].front + 1);
      }
      EXPECT_EQ(ranked[i].front, front);
    }
  }
}

TEST(Loops, exp_is_that_of_the_library) {
  std::vector<double> values;
  for (double x = -700; x <= 700; x += 0.37) values.push_back(x);
  std::vector<double> powers = values;
  exp_of_each(powers);
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(powers[i] / std::exp(values[i]), 1, 5e-16) << values[i];
}

// Of every length, as the last elements are worked out by themselves.
TEST(Loops, rows_and_sums_are_those_of_the_plain_loop) {
  Random random(3);
  constexpr std::size_t kMost = 11;
  std::vector<double> rows(kMost * kMost);
  for (double& value : rows) value = random.uniform();
  const std::vector<double> factors(rows.begin(), rows.begin() + kMost);
  for (std::size_t n = 0; n <= kMost; ++n) {
    for (std::size_t count = 0; count <= kMost; ++count) {
      std::vector<double> row(n, 1);
      subtract_rows(row, {.first = rows.data(), .stride = kMost}, {.first = factors.data(), .stride = 1}, count);
      for (std::size_t i = 0; i < n; ++i) {
        double expected = 1;
        for (std::size_t k = 0; k < count; ++k) expected -= factors[k] * rows[k * kMost + i];
        EXPECT_NEAR(row[i], expected, 1e-14);
      }
    }
    EXPECT_EQ(sum_of(static_cast<int>(n), [](int i) { return i; }), static_cast<double>(n * (n - (n > 0 ? 1 : 0)) / 2));
  }
}

TEST(Loops, the_kernel_is_its_formula) {
  constexpr int kPairs = 7;
  PairSums sums{.distance = Eigen::ArrayXd::LinSpaced(kPairs, 0, 40), .additive = Eigen::ArrayXd::Ones(kPairs)};
  PairSums moved = sums;
  const std::vector<double> squared(kPairs, 0.5);
  move_weight(sums, squared, {.before = 0, .after = 3}, moved);
  Eigen::ArrayXd kernel(kPairs);
  mixed_kernel(moved, 2, 0.25, kernel);
  for (int i = 0; i < kPairs; ++i) {
    const double distance = sums.distance[i] + 1.5;
    const double r = std::sqrt(5 * distance);
    const double additive = (1 - 1 + 1 / (1 + 1.5)) / 2;
    EXPECT_NEAR(moved.distance[i], distance, 1e-12);
    EXPECT_NEAR(kernel[i], 0.25 * additive + 0.75 * (1 + r + r * r / 3) * std::exp(-r), 1e-14);
  }
}

RC_GTEST_PROP(MostImprovement, is_never_less_than_the_expected_one, ()) {
  const double mean = *rc::gen::inRange(-900, 900) / 100.0;
  const double deviation = *rc::gen::inRange(0, 300) / 100.0;
  RC_ASSERT(most_improvement(0, mean, deviation) >= expected_improvement(0, mean, deviation));
}

// A move keeps what it leaves alone; afterwards all is as if it had been worked out anew.
TEST(Likelihood, a_moved_weight_ends_as_a_fresh_one) {
  Random random(8);
  constexpr Eigen::Index kPoints = 12;
  Likelihood::Points points{.squared = Eigen::ArrayXXd(kPoints * (kPoints - 1) / 2, 3),
                            .values = Eigen::VectorXd(kPoints),
                            .noise = Eigen::VectorXd::Constant(kPoints, 0.01)};
  for (Eigen::Index i = 0; i < points.squared.size(); ++i) points.squared.data()[i] = random.uniform();
  for (Eigen::Index i = 0; i < kPoints; ++i) points.values[i] = random.uniform();
  Likelihood likelihood(points, Eigen::VectorXd::Zero(4));
  int moves = 0;
  for (Eigen::Index weight = 0; weight < 4; ++weight)
    for (const double step : {2.0, -2.0, 1.0, -1.0})
      moves += likelihood.improve(weight, likelihood.log_weights()[weight] + step) ? 1 : 0;
  EXPECT_GT(moves, 0);
  const Likelihood fresh(points, likelihood.log_weights());
  EXPECT_NEAR(fresh.variance(), likelihood.variance(), 1e-9 * fresh.variance());
}

TEST(Surrogate, interpolates_and_is_sure_of_what_was_measured) {
  SearchSpace space{.category_axes = {"kind"}, .step_axes = {"steps"}, .candidates = {}};
  std::vector<double> truth;
  for (int i = 0; i < 60; ++i) {
    space.candidates.push_back(
        {.id = std::to_string(i), .categories = {i % 2}, .steps = {static_cast<double>(i)}, .error = 0});
    truth.push_back(std::log(3 + i) + 0.5 * (i % 2));
  }
  Surrogate surrogate(space, 20);
  for (std::size_t i = 0; i < 60; i += 3) surrogate.add(i, truth[i], 1e-6);
  surrogate.fit_if_due();
  surrogate.update();
  for (std::size_t i = 0; i < 60; ++i) EXPECT_NEAR(surrogate.mean(i), truth[i], 0.15) << i;
  EXPECT_LT(surrogate.deviation(3), 0.01);
  const double mean = surrogate.mean(10);
  surrogate.shrink(19);
  surrogate.add(57, truth[57], 1e-6);
  surrogate.update();
  EXPECT_NEAR(surrogate.mean(10), mean, 1e-9);
}

// Where a cap says little, what the rays did says it all: settings of kinds that were never timed are foretold.
TEST(Surrogate, work_foretells_the_time_of_kinds_not_timed_yet) {
  Random random(5);
  SearchSpace space{.category_axes = {"kind"}, .step_axes = {"cap"}, .work_axes = {"taps"}, .candidates = {}};
  std::vector<double> truth;
  for (int i = 0; i < 120; ++i) {
    const double taps = std::exp(4 * random.uniform());
    space.candidates.push_back({.id = std::to_string(i),
                                .categories = {i % 12},
                                .steps = {static_cast<double>(1 + random.below(100))},
                                .error = 0,
                                .work = {taps}});
    truth.push_back(std::log(1 + 0.2 * taps));
  }
  const auto worst_error = [&](const SearchSpace& seen) {
    Surrogate surrogate(seen, 40);
    for (std::size_t i = 0; i < 120; ++i)
      if (i % 12 < 3) surrogate.add(i, truth[i], 1e-6);
    surrogate.fit_if_due();
    surrogate.update();
    double worst = 0;
    for (std::size_t i = 0; i < 120; ++i) worst = std::max(worst, std::abs(surrogate.mean(i) - truth[i]));
    return worst;
  };
  EXPECT_LT(worst_error(space), 0.15);
  space.work_axes.clear();
  for (Candidate& candidate : space.candidates) candidate.work.clear();
  EXPECT_GT(worst_error(space), 0.5);
}

// On a device whose frames cost the same whatever they do, work is no reason to expect otherwise.
TEST(Surrogate, a_fixed_cost_is_learnt_from_few_points) {
  SearchSpace space{.category_axes = {"kind"}, .step_axes = {"cap"}, .work_axes = {"taps"}, .candidates = {}};
  for (int i = 0; i < 60; ++i)
    space.candidates.push_back({.id = std::to_string(i),
                                .categories = {i % 12},
                                .steps = {static_cast<double>(i)},
                                .error = 0,
                                .work = {std::exp(0.1 * i)}});
  Surrogate surrogate(space, 20);
  for (std::size_t i = 20; i < 30; ++i) surrogate.add(i, std::log(5.0), 1e-6);
  surrogate.fit_if_due();
  surrogate.update();
  for (std::size_t i = 0; i < 60; ++i) EXPECT_NEAR(surrogate.mean(i), std::log(5.0), 0.1) << i;
}

TEST(SearchSpace, refuses_what_it_cannot_search) {
  const auto fails = [](auto&& spoil, const char* words) {
    SearchSpace space{.category_axes = {"kind"}, .step_axes = {"steps"}, .work_axes = {"taps"}, .candidates = {}};
    for (const char* id : {"a", "b"})
      space.candidates.push_back({.id = id, .categories = {0}, .steps = {1}, .error = 1, .work = {2}});
    ASSERT_NO_THROW(space.check());
    spoil(space);
    EXPECT_THAT([&] { space.check(); }, testing::ThrowsMessage<Error>(testing::HasSubstr(words)));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  fails([](SearchSpace& space) { space.candidates.clear(); }, "no setting");
  fails([](SearchSpace& space) { space.candidates[1].id = "a"; }, "'a' is in the space twice");
  fails([&](SearchSpace& space) { space.candidates[1].error = nan; }, "'b' has error nan");
  fails([](SearchSpace& space) { space.candidates[1].error = -1; }, "'b' has error -1");
  fails([](SearchSpace& space) { space.candidates[0].categories.clear(); }, "'a' has 0 categories and 1 step counts");
  fails([](SearchSpace& space) { space.candidates[0].steps.push_back(1); }, "'a' has 1 categories and 2 step counts");
  fails([](SearchSpace& space) { space.candidates[0].work.clear(); }, "'a' has 0 counts of work, the space 1");
  fails([&](SearchSpace& space) { space.candidates[1].work[0] = nan; }, "'b' has nan of work");
}

}  // namespace
}  // namespace reliefbench
