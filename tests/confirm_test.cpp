// Re-runs of two builds in the order good, bad, bad, good.
#include "tuner/decide/confirm.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

struct MadeReruns {
  double step = 0;   ///< log, of the bad build
  double noise = 0;  ///< of a run
  double drift = 0;  ///< a run
  int rounds = 3;
};

std::vector<Rerun> reruns_of(const MadeReruns& made, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Rerun> reruns;
  for (int i = 0; i < 4 * made.rounds; ++i) {
    const bool is_bad = i % 4 == 1 || i % 4 == 2;
    const double shared = made.noise * normal(random) + made.drift * i + (is_bad ? made.step : 0);
    reruns.push_back({.is_bad = is_bad, .log_values = {{"a", shared}, {"b", 1 + shared}, {"only here", 7}}});
    if (i == 0) reruns.back().log_values.erase("only here");
  }
  return reruns;
}

TEST(ConfirmTest, a_drift_of_the_machine_is_no_step) {
  const RerunAnswer answer = judge_reruns(reruns_of({.step = 0.05, .noise = 0, .drift = 0.02}, 1), 0.05);
  EXPECT_NEAR(answer.log_ratio, 0.05, 1e-12);
  EXPECT_NEAR(answer.high - answer.low, 0, 1e-9);
  EXPECT_EQ(answer.series, 2U);
  EXPECT_EQ(answer.state, EventState::confirmed);
  EXPECT_EQ(judge_reruns(reruns_of({.drift = 0.02}, 1), 0.05).state, EventState::cleared);
}

TEST(ConfirmTest, its_interval_covers_and_it_is_rarely_wrong) {
  constexpr int kSeeds = 2000;
  int covered = 0;
  int confirmed_of_none = 0;
  int cleared_of_all = 0;
  int confirmed = 0;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    const RerunAnswer none = judge_reruns(reruns_of({.noise = 0.01, .drift = 0.003}, seed), 0.05);
    const RerunAnswer all = judge_reruns(reruns_of({.step = 0.05, .noise = 0.01, .drift = 0.003}, seed), 0.05);
    covered += all.low <= 0.05 && 0.05 <= all.high;
    confirmed_of_none += none.state == EventState::confirmed;
    cleared_of_all += all.state == EventState::cleared;
    confirmed += all.state == EventState::confirmed;
  }
  EXPECT_NEAR(covered, 0.95 * kSeeds, 0.015 * kSeeds);
  EXPECT_LE(confirmed_of_none, 0.035 * kSeeds);  // one side of 5 %
  EXPECT_LE(cleared_of_all, 0.01 * kSeeds);
  EXPECT_GE(confirmed, 0.99 * kSeeds);
}

TEST(ConfirmTest, says_so_where_it_cannot_say) {
  const RerunAnswer answer = judge_reruns(reruns_of({.step = 0.03, .noise = 0.05, .rounds = 2}, 3), 0.04);
  EXPECT_EQ(answer.state, std::nullopt);
}

TEST(ConfirmTest, an_improvement_is_confirmed_on_its_own_side) {
  EXPECT_EQ(judge_reruns(reruns_of({.step = -0.05, .noise = 0.005}, 1), -0.05).state, EventState::confirmed);
  EXPECT_EQ(judge_reruns(reruns_of({.step = 0.05, .noise = 0.005}, 1), -0.05).state, EventState::cleared);
}

// +0.1 % [+0.1, +0.1] confirmed an event of +9.9 %: another layout of the binary is worth as much.
TEST(ConfirmTest, a_step_that_is_certain_and_much_smaller_is_another_one) {
  for (const double side : {1.0, -1.0}) {
    const auto judged = [&](double step) {
      return judge_reruns(reruns_of({.step = side * step, .noise = 0.0002}, 1), side * 0.1).state;
    };
    EXPECT_EQ(judged(0.001), EventState::cleared);
    EXPECT_EQ(judged(0.04), EventState::cleared);
    EXPECT_EQ(judged(0.06), EventState::confirmed);
  }
}

TEST(ConfirmTest, runs_without_a_case_in_common_say_nothing) {
  std::vector<Rerun> reruns = reruns_of({}, 1);
  reruns[5].log_values = {{"another", 1}};
  EXPECT_THROW((void)judge_reruns(reruns, 0.05), Error);
}

}  // namespace
}  // namespace reliefbench
