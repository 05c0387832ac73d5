// Several runs of one place: bounds hold in each of them, what they share is found whatever their order, and no sample
// counts twice.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tests/written_run.h"
#include "tests/written_tables.h"
#include "tuner/decide/fleet.h"
#include "tuner/decide/hardware.h"
#include "tuner/decide/place_times.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

/// A run of some settings of cone and relief, by their step counts.
struct MadePlaceRun {
  std::string name = "run";
  std::vector<int> cones{};
  std::vector<int> reliefs{};
  double slowness = 1;
  unsigned seed = 1;
  double noise = 0.001;
};

FleetRun made_place_run(const MadePlaceRun& made) {
  std::mt19937 random(made.seed);
  std::normal_distribution<double> normal;
  FleetRun run{.name = made.name, .rows = {}};
  const auto add = [&](const char* technique, const char* param, int steps) {
    Settings one(find_technique(technique));
    one.set(param, steps);
    const double time_ns = 1e5 * steps * made.slowness;
    TableRow row{.case_id = fmt::format("{}{}", technique, steps),
                 .settings = one,
                 .map = std::string(map_of(one).id),
                 .backend = "vulkan",
                 .device = "GPU",
                 .scene = "rocks/oblique",
                 .reason = {},
                 .errors = std::vector<std::optional<double>>(metrics().size(), 1.0 / steps),
                 .frame_time = Summary{.median = time_ns, .ci_low = time_ns, .ci_high = time_ns, .n = 8},
                 .samples_ns = {}};
    for (int i = 0; i < 8; ++i) row.samples_ns.push_back(time_ns * std::exp(made.noise * normal(random)));
    run.rows.push_back(std::move(row));
  };
  for (const int steps : made.cones) add("cone", "cone_steps", steps);
  for (const int steps : made.reliefs) add("relief", "linear_steps", steps);
  return run;
}

/// By setting.
std::map<std::string, SettingTime> times_of(const std::vector<FleetRun>& runs) {
  const std::vector<MeasuredPlace> places = places_of(runs);
  EXPECT_EQ(places.size(), 1U);
  return place_times(places.front(), runs, [](const TableRow&) { return true; }).settings;
}

TEST(PlaceRuns, a_bound_on_time_holds_in_every_run) {
  const std::vector<FleetRun> runs = {
      made_place_run({.cones = {8, 16, 32}}),
      made_place_run({.name = "slow", .cones = {8, 16, 32}, .slowness = 3, .seed = 2})};  // 2.4, 4.8 and 9.6 ms
  const Fleet fleet = choose_for_fleet(runs, {.budgets = {}, .max_time_ms = 4});
  ASSERT_EQ(fleet.settings.size(), 1U);
  EXPECT_EQ(fleet.settings.front().settings, runs[0].rows[0].settings);
  // What a run could not measure says nothing against the others.
  std::vector<FleetRun> failed = runs;
  failed[1].rows[1].status = Status::timeout;
  EXPECT_EQ(choose_for_fleet(failed, {.budgets = {}, .max_time_ms = 4}).settings.size(), 2U);
}

TEST(PlaceRuns, what_runs_share_does_not_depend_on_their_order) {
  const std::vector<FleetRun> runs = {
      made_place_run({.reliefs = {8, 16, 32}}), made_place_run({.name = "cone", .cones = {8, 16, 32}, .seed = 2}),
      made_place_run({.name = "again", .reliefs = {8, 16, 32}, .slowness = 1.2, .seed = 3}),
      made_place_run({.name = "both", .cones = {16, 64}, .reliefs = {16}, .slowness = 1.1, .seed = 4})};
  for (const std::size_t count : {3U, 4U}) {  // the fourth joins what the others have
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < count; ++i) order.push_back(i);
    std::map<std::string, SettingTime> first;
    do {
      std::vector<FleetRun> ordered;
      for (const std::size_t i : order) ordered.push_back(runs[i]);
      const std::map<std::string, SettingTime> times = times_of(ordered);
      if (first.empty()) first = times;
      for (const auto& [id, time] : times) {
        EXPECT_NEAR(time.log_time, first.at(id).log_time, 1e-9) << id;
        EXPECT_NEAR(time.variance, first.at(id).variance, 1e-9 * first.at(id).variance) << id;
        EXPECT_NEAR(time.df, first.at(id).df, 1e-9) << id;
      }
    } while (std::ranges::next_permutation(order).found);
    // Of the cones alone nothing is known that could shift them.
    const std::string cone = setting_id(runs[1].rows[0].settings);
    if (count == 3) {
      EXPECT_NEAR(std::exp(first.at(cone).log_time), 8e5, 2e3);
    }
  }
}

TEST(PlaceRuns, a_shift_of_a_run_is_found_through_another) {
  // The first two share no setting; both share some with the last.
  const std::vector<FleetRun> runs = {
      made_place_run({.cones = {8, 16, 24}, .noise = 1e-6}),
      made_place_run({.name = "c", .cones = {32, 40}, .slowness = 1.1 * 1.2, .seed = 3, .noise = 1e-6}),
      made_place_run({.name = "b", .cones = {16, 24, 32}, .slowness = 1.1, .seed = 2, .noise = 1e-6})};
  const std::map<std::string, SettingTime> times = times_of(runs);
  const double mean = std::cbrt(1.1 * 1.1 * 1.2);
  for (const FleetRun& run : runs)
    for (const TableRow& row : run.rows) {
      const std::string id = setting_id(row.settings);
      const double own_ns = 1e5 * row.settings.get("cone_steps");
      EXPECT_NEAR(std::exp(times.at(id).log_time) / own_ns, mean, 1e-4) << id;
    }
}

TEST(PlaceRuns, a_measurement_that_is_given_twice_counts_once) {
  const std::vector<FleetRun> once = {made_place_run({.cones = {8, 16, 32}, .noise = 0.05})};
  std::vector<FleetRun> twice = once;
  twice.push_back(once.front());
  twice.back().name = "copy";
  twice.back().rows.pop_back();  // as of a shard that the first, a merged run, holds
  const Fleet alone = choose_for_fleet(once, {.budgets = {}});
  const Fleet fleet = choose_for_fleet(twice, {.budgets = {}});
  EXPECT_EQ(fleet.places.front().runs, (std::vector<std::size_t>{0}));
  EXPECT_FALSE(fleet.places.front().between_runs);
  for (std::size_t i = 0; i < alone.settings.size(); ++i)
    EXPECT_EQ(fleet.settings[i].losses[0].high, alone.settings[i].losses[0].high);
}

TEST(PlaceRuns, a_run_that_is_slower_throughout_is_no_copy) {
  std::vector<FleetRun> runs(2, made_place_run({.cones = {8, 16, 32}, .noise = 0.05}));
  for (TableRow& row : runs.back().rows)
    for (double& sample : row.samples_ns) sample *= 3;
  const Fleet fleet = choose_for_fleet(runs, {.budgets = {}});
  EXPECT_EQ(fleet.places.front().runs, (std::vector<std::size_t>{0, 1}));
  EXPECT_TRUE(fleet.repeated.empty());
}

TEST(PlaceRuns, a_part_that_a_merge_brought_to_another_speed_counts_once) {
  const auto started = [](const char* shard) {
    return nlohmann::json{{"identity", {{"shard", shard}}}, {"started_unix_ns", 1.7e18}};
  };
  std::vector<FleetRun> runs(2, made_place_run({.cones = {8, 16, 32}, .noise = 0.05}));
  for (TableRow& row : runs.back().rows)
    for (double& sample : row.samples_ns) sample *= 1.1;
  runs[0].info = started("1/3");
  runs[1].info = {{"parts", {started("2/3"), started("1/3")}}};
  const Fleet fleet = choose_for_fleet(runs, {.budgets = {}});
  EXPECT_EQ(fleet.places.front().runs, (std::vector<std::size_t>{0}));
  ASSERT_EQ(fleet.repeated.size(), 1U);
  EXPECT_THAT(fleet.repeated.front(), HasSubstr("3 of its cases are the same measurement"));
  runs[1].info = {{"parts", {started("2/3"), started("3/3")}}};
  EXPECT_TRUE(choose_for_fleet(runs, {.budgets = {}}).repeated.empty()) << "they are other times";
  runs[1].info = runs[0].info;
  runs[1].rows.front().samples_ns.back() *= 1.001;
  EXPECT_THAT(choose_for_fleet(runs, {.budgets = {}}).repeated.front(), HasSubstr("2 of its cases")) << "one case not";
}

TEST(PlaceRuns, the_commands_say_what_is_given_twice) {
  const TempFolder folder;
  for (const char* name : {"a", "b"})
    write_run(sampled_run({.folder = folder / name, .backends = {"vulkan"}, .scenes = {"s"}, .with_failed = false}));
  const auto choose = [&](const std::string& second) {
    const CommandResult result =
        run_reliefbench({"choose", "a", second, "--max-error", "missed_rate<=1"}, folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  };
  EXPECT_EQ(choose("b"), "reliefbench: b: 60 of its cases are the same measurement as in a and count once\n");
  EXPECT_THAT(choose("a"), HasSubstr("the same measurement as in a"));
}

// A software device is as fast as its processor, and a table has the five first digits of the samples it is a copy of.
TEST(PlaceRuns, a_table_knows_its_processor_and_what_it_is_a_copy_of) {
  const auto measured_on = [](const char* processor) {
    reliefbench::Run run = sampled_run({.backends = {"vulkan"}, .scenes = {"s"}, .with_failed = false});
    run.info["host"]["cpu"] = processor;
    run.info["devices"][0].update({{"driver", "llvmpipe 15"}, {"software", true}});
    return run;
  };
  const auto table_of = [](const reliefbench::Run& run) {
    return FleetRun{.name = "table.csv", .rows = parse_case_table(case_table_csv(case_table(run)), "table.csv")};
  };
  const reliefbench::Run here = measured_on("CPU A");
  const FleetRun table = table_of(here);
  EXPECT_EQ(table.rows.front().driver, "llvmpipe 15");
  EXPECT_EQ(table.rows.front().machine, "CPU A");

  const std::vector<FleetRun> twice = {fleet_run(here), table};
  const std::vector<MeasuredPlace> one = places_of(twice);
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one.front().runs, (std::vector<std::size_t>{0}));
  EXPECT_EQ(one.front().repeated.size(), 1U);

  const std::vector<FleetRun> two = {table, table_of(measured_on("CPU B"))};
  EXPECT_EQ(places_of(two).size(), 2U);
}

TEST(PlaceRuns, where_nothing_was_measured_that_is_the_answer) {
  FleetRun run = made_place_run({.cones = {8, 16}});
  for (TableRow& row : run.rows) row.status = Status::throttled;
  try {
    (void)choose_for_fleet({&run, 1}, {.budgets = {}});
    FAIL() << "chose of nothing";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::nothing_measured);
    EXPECT_THAT(error.what(), HasSubstr("nothing was measured on vulkan GPU in rocks/oblique"));
  }
}

// A table without scene keys matches by name, which must not make two scenes of one name match each other.
TEST(PlaceRuns, only_a_table_without_keys_matches_by_name) {
  const auto on = [](const char* device, const std::string& key, double slowness, unsigned seed) {
    FleetRun run = made_place_run({.name = device, .cones = {8, 16, 32, 64}, .slowness = slowness, .seed = seed});
    for (TableRow& row : run.rows) {
      row.device = device;
      row.scene_key = SceneKey{key};
    }
    return run;
  };
  const std::vector<FleetRun> runs = {on("small", std::string(64, 'a'), 1, 1), on("large", std::string(64, 'b'), 6, 2),
                                      on("old", "", 1.5, 3)};
  const HardwareComparison comparison = compare_hardware(runs, {});
  ASSERT_EQ(comparison.pairs.size(), 2U);
  for (const DevicePair& pair : comparison.pairs) EXPECT_EQ(pair.now, 2U);
  ASSERT_EQ(comparison.fronts.size(), 2U);
  EXPECT_EQ(comparison.fronts[0].columns, (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(comparison.fronts[1].columns, (std::vector<std::size_t>{1, 2}));
  EXPECT_TRUE(comparison.warnings.empty());
}

}  // namespace
}  // namespace reliefbench
