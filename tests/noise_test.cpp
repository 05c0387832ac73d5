// The bounds of a setting's time, where frames of a block are tied together.
#include "tuner/search/noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>
#include <vector>

#include "tuner/search/random.h"

namespace reliefbench {
namespace {

double normal(Random& random) {
  return std::sqrt(-2 * std::log1p(-random.uniform())) * std::cos(2 * std::numbers::pi * random.uniform());
}

/// Blocks of settings around log time 0 with noise of 1 %: of a correlation, and a share of them held up as a whole.
/// prone: a setting of so many has all blocks that are held up
struct Machine {
  double correlation = 0;
  double held_up = 0;
  std::size_t prone = 1;

  [[nodiscard]] std::array<double, kBlock> block(std::size_t setting, Random& random) const {
    const double shared = std::sqrt(correlation) * normal(random);
    const double share = setting % prone == 0 ? static_cast<double>(prone) * held_up : 0;
    const double late = random.uniform() < share ? 0.5 : 0.0;
    std::array<double, kBlock> frames{};
    for (double& frame : frames) frame = late + 0.01 * (shared + std::sqrt(1 - correlation) * normal(random));
    return frames;
  }
  [[nodiscard]] std::vector<Observed> observe(std::size_t settings, int most_blocks, Random& random) const {
    std::vector<Observed> observed(settings);
    for (std::size_t i = 0; i < settings; ++i) {
      observed[i].order = static_cast<int>(i);
      const auto blocks = 1 + static_cast<int>(random.below(static_cast<std::uint64_t>(most_blocks)));
      for (int block_of_it = 0; block_of_it < blocks; ++block_of_it) observed[i].add(block(i, random));
    }
    return observed;
  }
};

TEST(NoiseModel, estimates_the_correlation_from_above) {
  Random random(1);
  for (const double correlation : {0.0, 0.31, 0.65, 0.95}) {
    const Machine machine{.correlation = correlation};
    NoiseModel model(200, 0.95);
    model.fit(machine.observe(200, 10, random));
    EXPECT_GT(model.correlation(), correlation - 0.02);
    EXPECT_LT(model.correlation(), correlation + 0.15);
  }
}

TEST(NoiseModel, knows_no_correlation_before_it_saw_blocks_and_then_takes_the_worst) {
  NoiseModel model(10, 0.95);
  EXPECT_EQ(model.correlation(), 1);
  Random random(2);
  model.fit(Machine{}.observe(10, 1, random));
  EXPECT_EQ(model.correlation(), 1);
}

TEST(NoiseModel, one_block_bounds_nothing) {
  Random random(3);
  std::vector<Observed> observed = Machine{}.observe(100, 8, random);
  NoiseModel model(100, 0.95);
  model.fit(observed);
  for (Observed& setting : observed) {
    const NoiseModel::Bounds bounds = model.bound(setting);
    EXPECT_EQ(std::isinf(bounds.lower), setting.count() == 1);
    EXPECT_EQ(std::isinf(bounds.upper), setting.count() == 1);
  }
}

/// Of so many machines, on how many all bounds of all settings hold.
int machines_bounded(const Machine& machine, int machines) {
  int held = 0;
  for (int seed = 0; seed < machines; ++seed) {
    Random random(static_cast<std::uint64_t>(seed) + 100);
    std::vector<Observed> observed = machine.observe(150, 12, random);
    NoiseModel model(150, 0.95);
    model.fit(observed);
    bool all = true;
    for (Observed& setting : observed) {
      const NoiseModel::Bounds bounds = model.bound(setting);
      all = all && bounds.lower <= 0.0025 && bounds.upper >= -0.0025;
    }
    held += all ? 1 : 0;
  }
  return held;
}

TEST(NoiseModel, all_bounds_hold_at_once_whatever_the_correlation) {
  for (const double correlation : {0.0, 0.31, 0.65, 1.0})
    EXPECT_GE(machines_bounded({.correlation = correlation}, 100), 95) << correlation;
}

TEST(NoiseModel, lower_bounds_hold_where_whole_blocks_are_held_up) {
  EXPECT_GE(machines_bounded({.correlation = 0.65, .held_up = 0.04}, 200), 195);
}

TEST(NoiseModel, lower_bounds_hold_where_some_settings_are_held_up_more_often_than_others) {
  EXPECT_GE(machines_bounded({.correlation = 0.65, .held_up = 0.02, .prone = 4}, 200), 195);
}

TEST(NoiseModel, correlation_costs_width) {
  const auto mean_width = [](double correlation) {
    Random random(5);
    std::vector<Observed> observed = Machine{.correlation = correlation}.observe(200, 12, random);
    NoiseModel model(200, 0.95);
    model.fit(observed);
    double sum = 0;
    int count = 0;
    for (Observed& setting : observed) {
      const NoiseModel::Bounds bounds = model.bound(setting);
      if (setting.count() < 8) continue;
      sum += bounds.upper - bounds.lower;
      ++count;
    }
    return sum / count;
  };
  const double alone = mean_width(0);
  EXPECT_GT(mean_width(0.65), 1.3 * alone);
  EXPECT_LT(mean_width(0.65), 2.5 * alone);
}

/// Mean over triples of frames of three blocks, by definition.
double median_by_definition(std::span<const std::array<double, kBlock>> blocks) {
  double sum = 0;
  int count = 0;
  for (std::size_t a = 0; a < blocks.size(); ++a)
    for (std::size_t b = a + 1; b < blocks.size(); ++b)
      for (std::size_t c = b + 1; c < blocks.size(); ++c)
        for (const double x : blocks[a])
          for (const double y : blocks[b])
            for (const double z : blocks[c]) {
              sum += std::max(std::min(x, y), std::min(std::max(x, y), z));
              ++count;
            }
  return sum / count;
}

TEST(MedianAcrossBlocks, is_the_mean_over_triples_of_three_blocks) {
  Random random(6);
  for (const std::size_t count : {3U, 4U, 7U}) {
    Observed observed;
    std::vector<std::array<double, kBlock>> blocks(count);
    for (std::array<double, kBlock>& block : blocks) {
      for (double& frame : block) frame = random.uniform();
      observed.add(block);
      for (double& frame : block) frame = std::clamp(frame, 0.2, 0.7);
    }
    EXPECT_NEAR(median_across_blocks(observed, 0.2, 0.7), median_by_definition(blocks), 1e-12);
    EXPECT_EQ(observed.across, median_across_blocks(observed, 0, 1));
  }
}

TEST(MedianAcrossBlocks, of_two_blocks_are_pairs) {
  Observed observed;
  observed.add({1, 4, 6});
  observed.add({2, 3, 5});
  EXPECT_NEAR(lesser_across_blocks(observed, 0, 9), (1 + 1 + 1 + 2 + 3 + 4 + 2 + 3 + 5) / 9.0, 1e-12);
  EXPECT_NEAR(greater_across_blocks(observed, 0, 9), (2 + 3 + 5 + 4 + 4 + 5 + 6 + 6 + 6) / 9.0, 1e-12);
}

// A block in five is held up as a whole by 0.5: of three independent frames two are with a chance of 0.104.
TEST(MedianAcrossBlocks, is_unbiased_where_a_block_is_held_up_as_a_whole) {
  const Machine machine{.held_up = 0.2};
  Random random(7);
  double across = 0;
  double within = 0;
  constexpr int kSettings = 20000;
  for (int i = 0; i < kSettings; ++i) {
    Observed observed;
    for (int block = 0; block < 5; ++block) observed.add(machine.block(0, random));
    across += observed.across / kSettings;
    within += observed.plain / kSettings;
  }
  EXPECT_NEAR(across, 0.5 * 0.104, 0.003);
  EXPECT_GT(within, 0.5 * 0.104 + 0.01);
}

double binomial_tail(int trials, int least, double chance) {
  double sum = 0;
  for (int hits = least; hits <= trials; ++hits)
    sum += std::exp(std::lgamma(trials + 1.0) - std::lgamma(hits + 1.0) - std::lgamma(trials - hits + 1.0)) *
           std::pow(chance, hits) * std::pow(1 - chance, trials - hits);
  return sum;
}

TEST(RankBound, chances_of_all_counts_add_up_to_no_more_than_alpha) {
  const double alpha = 1e-4;
  const auto tails = tails_for(-std::log(alpha));
  double sum = 0;
  for (int count = 1; count <= kMostRanked; ++count) {
    const double tail = tails[static_cast<std::size_t>(count) - 1];
    if (count > 1 && rank_of(count) == rank_of(count - 1)) {
      EXPECT_GT(tail, tails[static_cast<std::size_t>(count) - 2]);
    }
    sum += binomial_tail(count, count - rank_of(count) + 1, kProne * tail) / kProne;
  }
  EXPECT_LE(sum, alpha);
  EXPECT_GT(sum, 0.9 * alpha);
}

TEST(RankBound, is_the_samples_quantile_where_it_shows_one_and_beyond_it_elsewhere) {
  std::vector<double> values;
  for (int i = 0; i < 1000; ++i) values.push_back(0.01 * (1 + i * 387 % 1000));  // 0.01 ... 10
  sort_tail(values, 0.1);
  EXPECT_NEAR(beyond(values, 0.1), 9.2, 0.011);    // two standard errors above 9
  EXPECT_NEAR(beyond(values, 0.05), 9.64, 0.011);  // likewise
  EXPECT_EQ(beyond(values, 1e-4), 15);
  sort_tail(values, 2);
  EXPECT_TRUE(std::ranges::is_sorted(values, std::greater{}));
  EXPECT_EQ(beyond({}, 0.1), kLeastBeyond);
}

}  // namespace
}  // namespace reliefbench
