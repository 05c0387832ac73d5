// One setting for a fleet: the pick by enumeration, what its intervals cover, and recorded runs of a processor and a
// GPU.
#include "tuner/decide/fleet.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/temp_folder.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;

/// Runs of as many devices with the very times that are known, but for noise.
struct MadeFleet {
  std::vector<FleetRun> runs;
  std::vector<std::vector<double>> true_ns;  ///< [place][setting]
  std::vector<std::string> ids;

  [[nodiscard]] double true_loss(std::size_t place, std::size_t setting) const {
    return true_ns[place][setting] / *std::ranges::min_element(true_ns[place]) - 1;
  }
  [[nodiscard]] std::size_t place_of(const std::string& id) const {
    return static_cast<std::size_t>(std::ranges::find(ids, id) - ids.begin());
  }
};

MadeFleet made_fleet(unsigned seed, std::size_t places, std::size_t settings, double noise, int samples) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  MadeFleet fleet;
  std::vector<Settings> all;
  std::vector<double> shared;
  for (std::size_t s = 0; s < settings; ++s) {
    Settings one(find_technique("cone"));
    one.set("cone_steps", static_cast<int>(8 + s));
    fleet.ids.push_back(setting_id(one));
    all.push_back(one);
    shared.push_back(1e6 * std::exp(0.2 * normal(random)));
  }
  for (std::size_t p = 0; p < places; ++p) {
    FleetRun run{.name = fmt::format("run{}", p), .rows = {}};
    fleet.true_ns.emplace_back();
    for (std::size_t s = 0; s < settings; ++s) {
      const double true_ns = shared[s] * std::exp(0.1 * normal(random));
      fleet.true_ns.back().push_back(true_ns);
      TableRow row{.case_id = fmt::format("case{}", s),
                   .settings = all[s],
                   .map = "conservative",
                   .backend = "vulkan",
                   .device = fmt::format("device {}", p),
                   .scene = "rocks/oblique",
                   .reason = {},
                   .errors = std::vector<std::optional<double>>(metrics().size(), 0.1),
                   .frame_time = {},
                   .samples_ns = {}};
      for (int i = 0; i < samples; ++i) row.samples_ns.push_back(true_ns * std::exp(noise * normal(random)));
      run.rows.push_back(std::move(row));
    }
    fleet.runs.push_back(std::move(run));
  }
  return fleet;
}

bool all_hold(const MadeFleet& made, const Fleet& fleet) {
  for (const FleetSetting& one : fleet.settings) {
    const std::size_t s = made.place_of(setting_id(one.settings));
    double worst = 0;
    for (std::size_t p = 0; p < one.losses.size(); ++p) {
      const double truth = made.true_loss(p, s);
      worst = std::max(worst, truth);
      if (one.losses[p].low > truth + 1e-12 || truth > one.losses[p].high + 1e-12) return false;
    }
    if (one.combined.low > worst + 1e-12 || worst > one.combined.high + 1e-12) return false;
  }
  return true;
}

std::vector<Budget> budgets() { return parse_budgets(std::vector<std::string>{"e_xy.p99<=0.5"}); }

TEST(FleetTest, picks_what_enumeration_does) {
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U, 6U, 7U, 8U}) {
    const MadeFleet made = made_fleet(seed, 3, 12, 0, 3);
    const Fleet fleet = choose_for_fleet(made.runs, {.budgets = budgets()});
    std::size_t best = 0;
    std::vector<double> worst;
    for (std::size_t s = 0; s < made.ids.size(); ++s) {
      worst.push_back(0);
      for (std::size_t p = 0; p < 3; ++p) worst[s] = std::max(worst[s], made.true_loss(p, s));
      if (worst[s] < worst[best]) best = s;
    }
    EXPECT_EQ(setting_id(fleet.settings.front().settings), made.ids[best]) << seed;
    EXPECT_NEAR(fleet.settings.front().combined.value, worst[best], 1e-9);
    for (std::size_t p = 0; p < 3; ++p) {
      EXPECT_NEAR(fleet.own[p].losses[p]->value, 0, 1e-12);
      const std::size_t own = made.place_of(setting_id(fleet.own[p].settings));
      for (std::size_t other = 0; other < 3; ++other)
        EXPECT_NEAR(fleet.own[p].losses[other]->value, made.true_loss(other, own), 1e-9);
    }
  }
}

TEST(FleetTest, weights_move_the_mean) {
  MadeFleet made = made_fleet(3, 2, 12, 0, 3);
  made.runs[0].weight = 1000;
  const Fleet fleet = choose_for_fleet(made.runs, {.budgets = budgets(), .regret = Regret::mean});
  EXPECT_EQ(setting_id(fleet.settings.front().settings), setting_id(fleet.own[0].settings));
}

/// All intervals of a fleet at once, the pick's combined one among them: as often as they promise, and not by being
/// endless.
TEST(FleetTest, its_intervals_hold_together) {
  constexpr int kFleets = 200;
  for (const double noise : {0.005, 0.03}) {
    int held = 0;
    double width = 0;
    for (unsigned seed = 0; seed < kFleets; ++seed) {
      const MadeFleet made = made_fleet(seed, 3, 40, noise, 10);
      const Fleet fleet = choose_for_fleet(made.runs, {.budgets = budgets()});
      held += all_hold(made, fleet);
      width += (fleet.settings.front().combined.high - fleet.settings.front().combined.low) / kFleets;
    }
    std::cout << fmt::format(
        "noise {:.1f} %: all intervals hold in {:.1f} % of {} fleets; the pick's is {:.1f} % wide\n", 100 * noise,
        100.0 * held / kFleets, kFleets, 100 * width);
    EXPECT_GE(held, 0.93 * kFleets);
    EXPECT_LE(width, 12 * noise);
  }
}

TEST(FleetTest, what_misses_a_budget_somewhere_is_no_choice) {
  MadeFleet made = made_fleet(1, 2, 6, 0, 3);
  const std::size_t error = find_metric("e_xy.p99").place;
  made.runs[0].rows[0].errors[error] = 0.9;
  made.runs[1].rows[1].errors[error] = 0.9;
  made.runs[1].rows[2].status = Status::timeout;
  const Fleet fleet = choose_for_fleet(made.runs, {.budgets = budgets()});
  EXPECT_EQ(fleet.settings.size(), 3U);
  EXPECT_EQ(fleet.places[0].settings, 5U);
  EXPECT_EQ(fleet.places[1].settings, 4U);
  for (TableRow& row : made.runs[1].rows) row.errors[error] = 0.9;
  try {
    (void)choose_for_fleet(made.runs, {.budgets = budgets()});
    FAIL() << "nothing to choose from";
  } catch (const Error& thrown) {
    EXPECT_EQ(thrown.code(), Exit::answer_is_no);
    EXPECT_THAT(thrown.what(), HasSubstr("nothing meets e_xy.p99<=0.5 on vulkan device 1 in rocks/oblique"));
  }
}

/// Two runs of each device, each case of which is shifted by itself, and each run as a whole.
MadeFleet twice_made_fleet(unsigned seed, double noise, double shift) {
  MadeFleet made = made_fleet(seed, 2, 40, noise, 10);
  std::mt19937 random(seed + 1'000'000);
  std::normal_distribution<double> normal;
  const std::size_t devices = made.runs.size();
  for (std::size_t p = 0; p < devices; ++p) {
    FleetRun again = made.runs[p];
    again.name += " again";
    for (FleetRun* run : {&made.runs[p], &again}) {
      const double whole = 0.05 * normal(random);
      for (std::size_t s = 0; s < run->rows.size(); ++s) {
        const double shifted = made.true_ns[p][s] * std::exp(whole + shift * normal(random));
        for (double& sample : run->rows[s].samples_ns) sample = shifted * std::exp(noise * normal(random));
      }
    }
    made.runs.push_back(again);
  }
  return made;
}

/// A case that shifts between runs makes intervals of one run false; two runs say by how much it does.
TEST(FleetTest, intervals_pay_for_what_shifts_between_runs) {
  constexpr int kFleets = 200;
  int with_two = 0;
  int with_one = 0;
  double shift = 0;
  for (unsigned seed = 0; seed < kFleets; ++seed) {
    const MadeFleet made = twice_made_fleet(seed, 0.005, 0.02);
    const Fleet fleet = choose_for_fleet(made.runs, {.budgets = budgets()});
    ASSERT_EQ(fleet.places.size(), 2U);
    with_two += all_hold(made, fleet);
    shift += *fleet.places[0].between_runs / kFleets;
    const std::span<const FleetRun> first(made.runs.data(), 2);
    const Fleet alone = choose_for_fleet(first, {.budgets = budgets()});
    EXPECT_FALSE(alone.places[0].between_runs);
    with_one += all_hold(made, alone);
  }
  std::cout << fmt::format(
      "two runs of a device, cases shift by 2 % (estimated: {:.2f} %): all intervals hold in {:.1f} "
      "% of {} fleets; of one run in {:.1f} %\n",
      100 * shift, 100.0 * with_two / kFleets, kFleets, 100.0 * with_one / kFleets);
  EXPECT_NEAR(shift, 0.02, 0.003);
  EXPECT_GE(with_two, 0.93 * kFleets);
  EXPECT_LE(with_one, 0.2 * kFleets);
}

TEST(FleetTest, a_bound_on_time_asks_for_the_least_error) {
  MadeFleet made = made_fleet(1, 2, 6, 0, 3);
  const std::size_t error = find_metric("e_xy.p99").place;
  const double errors[2][6] = {{0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, {0.1, 0.35, 0.5, 0.6, 0.1, 0.2}};
  for (std::size_t p = 0; p < 2; ++p)
    for (std::size_t s = 0; s < 6; ++s) {
      TableRow& row = made.runs[p].rows[s];
      row.errors[error] = errors[p][s];
      const double time_ns = (s == 0 ? 3 : 1) * 1e6;  // the first is too slow
      row.samples_ns.assign(3, time_ns);
      row.frame_time = Summary{.median = time_ns, .mad = 0, .ci_low = time_ns, .ci_high = time_ns, .n = 3};
    }
  const FleetOptions options{.budgets = {}, .max_time_ms = 2};
  const Fleet fleet = choose_for_fleet(made.runs, options);
  // Within the time the least errors are .2 and .1; beyond them the worst of the settings 1 to 5 are .25 .4 .5 .3 .4.
  ASSERT_EQ(fleet.settings.size(), 5U);
  EXPECT_EQ(setting_id(fleet.settings.front().settings), made.ids[1]);
  EXPECT_NEAR(fleet.settings.front().combined.value, 0.25, 1e-12);
  EXPECT_NEAR(fleet.own[0].losses[1]->value, 0.25, 1e-12);
  EXPECT_EQ(setting_id(fleet.own[1].settings), made.ids[4]);
  EXPECT_THROW((void)choose_for_fleet(made.runs, {.budgets = {}, .max_time_ms = 2, .error_metric = "psnr"}), Error);
  try {
    (void)choose_for_fleet(made.runs, {.budgets = {}, .max_time_ms = 0.5});
    FAIL() << "nothing is as fast";
  } catch (const Error& thrown) {
    EXPECT_EQ(thrown.code(), Exit::answer_is_no);
    EXPECT_THAT(thrown.what(), HasSubstr("nothing meets at most 0.5 ms on vulkan device 0"));
  }
}

const std::filesystem::path kRecorded = std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "tests/data";

TEST(FleetTest, recorded_runs_of_a_processor_and_a_gpu_have_one_setting) {
  std::vector<FleetRun> runs;
  for (const char* name : {"exhaustive_rocks.csv", "exhaustive_rocks_h200.csv", "exhaustive_bricks.csv"})
    runs.push_back({.name = name, .rows = load_case_table(kRecorded / name)});
  const FleetOptions options{.budgets = parse_budgets(std::vector<std::string>{"e_xy.p99<=0.5", "missed_rate<=0.001"})};
  const Fleet fleet = choose_for_fleet(runs, options);
  ASSERT_EQ(fleet.places.size(), 3U);
  // By enumeration, of the medians of the samples.
  double least_worst = 1e9;
  for (const FleetSetting& one : fleet.settings) {
    double worst = 0;
    for (const Loss& loss : one.losses) worst = std::max(worst, loss.value);
    EXPECT_DOUBLE_EQ(worst, one.combined.value);
    least_worst = std::min(least_worst, worst);
  }
  EXPECT_EQ(fleet.settings.front().combined.value, least_worst);
  for (const Loss& loss : fleet.settings.front().losses) {
    EXPECT_LE(loss.low, loss.value);
    EXPECT_GE(loss.high, loss.value);
    EXPECT_LT(loss.value, 0.2);
  }
  // What is best on the processor costs the GPU something, and the other way round: else a fleet needs no command.
  EXPECT_TRUE(!fleet.own[0].losses[1] || fleet.own[0].losses[1]->value > 0.01);
}

TEST(FleetTest, the_command_says_it) {
  const TempFolder folder;
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"choose", (kRecorded / "exhaustive_rocks.csv").string(),
                                          (kRecorded / "exhaustive_rocks_h200.csv").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_reliefbench(arguments, folder.path());
  };
  CommandResult result = run({});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("One setting for 2 places with e_xy.p99<=0.5 and missed_rate<=0.001"));
  EXPECT_THAT(result.out, HasSubstr("vulkan NVIDIA H200 in rocks/grazing"));
  result = run({"--json"});
  const nlohmann::json json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("places").size(), 2U);
  EXPECT_GT(json.at("settings").size(), 100U);
  result = run({"--max-error", "e_xy.max<=0"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("reliefbench: nothing meets e_xy.max<=0 on"));
  EXPECT_EQ(run({"--weights", "1,2,3"}).exit_code, 2);
}

}  // namespace
}  // namespace reliefbench
