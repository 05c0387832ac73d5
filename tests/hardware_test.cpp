// Devices, drivers and backends beside each other: on made runs whose truth is known, and on recorded ones.
#include "tuner/decide/hardware.h"

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

using testing::ElementsAre;
using testing::HasSubstr;

struct MadeDevice {
  std::string device = "GPU 0";
  std::string backend = "vulkan";
  std::string driver = "1.0";
  std::string scene = "rocks/oblique";
  char key = 'a';   ///< of the scene
  double cone = 1;  ///< factors on times
  double relief = 1;
  double shift = 0;  ///< deviation of what shifts a case in this run
  unsigned seed = 1;
  double noise = 0.01;
};

/// Twenty cones, ten reliefs: the more steps, the longer and the more accurate.
FleetRun made_run(const MadeDevice& made) {
  std::mt19937 random(made.seed);
  std::normal_distribution<double> normal;
  FleetRun run{.name = fmt::format("run of {} {}", made.device, made.seed), .rows = {}};
  run.info = {{"devices", {{{"backend", made.backend}, {"driver", made.driver}, {"software", false}}}},
              {"host", {{"governor", made.seed % 2 == 0 ? "performance" : "powersave"}}},
              {"git_sha", "abc"}};
  for (int i = 0; i < 30; ++i) {
    const bool is_cone = i < 20;
    Settings settings(find_technique(is_cone ? "cone" : "relief"));
    settings.set(is_cone ? "cone_steps" : "linear_steps", 8 + i);
    const double time_ns =
        1e6 * (1 + 0.1 * i) * (is_cone ? made.cone : made.relief) * std::exp(made.shift * normal(random));
    TableRow row{.case_id = fmt::format("case{}", i),
                 .settings = settings,
                 .map = is_cone ? "conservative" : "height",
                 .backend = made.backend,
                 .device = made.device,
                 .driver = made.driver,
                 .scene = made.scene,
                 .scene_key = {std::string(64, made.key)},
                 .reason = {},
                 .errors = std::vector<std::optional<double>>(metrics().size(), 3.0 - 0.1 * i),
                 .frame_time = {},
                 .samples_ns = {}};
    for (int k = 0; k < 10; ++k) row.samples_ns.push_back(time_ns * std::exp(made.noise * normal(random)));
    run.rows.push_back(std::move(row));
  }
  return run;
}

const PairGroup& group_of(const DevicePair& pair, const std::string& name) {
  const auto found = std::ranges::find(pair.groups, name, &PairGroup::group);
  if (found == pair.groups.end()) throw std::out_of_range(name);
  return *found;
}

TEST(HardwareTest, cases_match_across_devices_and_pool_by_technique) {
  const std::vector<FleetRun> runs = {made_run({}), made_run({.device = "GPU 1", .cone = 0.5, .relief = 2, .seed = 2})};
  const HardwareComparison comparison = compare_hardware(runs, {});
  ASSERT_EQ(comparison.columns.size(), 2U);
  ASSERT_EQ(comparison.pairs.size(), 1U);
  const DevicePair& pair = comparison.pairs.front();
  EXPECT_EQ(pair.cases.size(), 30U);
  EXPECT_NEAR(group_of(pair, "technique=cone").ratio.ratio, 0.5, 0.01);
  EXPECT_NEAR(group_of(pair, "technique=relief").ratio.ratio, 2, 0.03);
  // The geometric mean, from the cases themselves.
  double logs = 0;
  for (const PairCase& one : pair.cases) logs += std::log(one.now_ns / one.base_ns) / 30;
  EXPECT_NEAR(pair.groups.front().ratio.ratio, std::exp(logs), 1e-12);
  EXPECT_LT(pair.groups.front().low_case, 0.52);
  EXPECT_GT(pair.groups.front().high_case, 1.95);
  std::vector<std::string> different;
  for (const EnvironmentDifference& difference : comparison.environment) different.push_back(difference.what);
  EXPECT_THAT(different, ElementsAre("device", "governor"));
  EXPECT_EQ(exit_of(comparison), Exit::done);
}

TEST(HardwareTest, intervals_of_means_cover) {
  constexpr int kSeeds = 300;
  int covered = 0;
  int technique = 0;
  int single = 0;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    const std::vector<FleetRun> runs = {
        made_run({.seed = 2 * seed + 1, .noise = 0.03}),
        made_run({.device = "GPU 1", .cone = 0.5, .relief = 2, .seed = 2 * seed + 2, .noise = 0.03})};
    const DevicePair pair = compare_hardware(runs, {}).pairs.front();
    const double truth = std::exp((20 * std::log(0.5) + 10 * std::log(2.0)) / 30);
    const RatioInterval& whole = pair.groups.front().ratio;
    covered += whole.low <= truth && truth <= whole.high;
    const RatioInterval& cones = group_of(pair, "technique=cone").ratio;
    technique += cones.low <= 0.5 && 0.5 <= cones.high;
    single += pair.cases.front().ratio.low <= 0.5 && 0.5 <= pair.cases.front().ratio.high;
  }
  std::cout << fmt::format("of {}: whole {}, technique {}\n", kSeeds, covered, technique);
  EXPECT_GE(covered, 0.93 * kSeeds);
  EXPECT_GE(technique, 0.93 * kSeeds);
  EXPECT_GE(single, 0.5 * kSeeds);  // of the least of thirty ratios, which is chosen for being low
}

TEST(HardwareTest, two_runs_of_a_device_say_what_shifts_between_them) {
  const std::vector<FleetRun> runs = {made_run({.shift = 0.05}), made_run({.shift = 0.05, .seed = 3}),
                                      made_run({.device = "GPU 1", .seed = 5})};
  const HardwareComparison comparison = compare_hardware(runs, {});
  ASSERT_EQ(comparison.columns.size(), 2U);
  EXPECT_THAT(comparison.columns[0].runs, ElementsAre(0, 1));
  EXPECT_NEAR(*comparison.columns[0].between_runs, 0.05, 0.025);
  EXPECT_FALSE(comparison.columns[1].between_runs);
}

TEST(HardwareTest, fronts_say_who_is_on_which) {
  // On the second device all reliefs, which are the most accurate, are slower than before and the cones much faster:
  // nothing leaves a front that is ordered by steps. Then one cone becomes slower than a more accurate one.
  std::vector<FleetRun> runs = {made_run({.noise = 0}), made_run({.device = "GPU 1", .seed = 2, .noise = 0})};
  for (double& sample : runs[1].rows[4].samples_ns) sample *= 1.2;
  const HardwareComparison comparison = compare_hardware(runs, {.error_metric = "e_xy.p99"});
  ASSERT_EQ(comparison.fronts.size(), 1U);
  const SceneFronts& scene = comparison.fronts.front();
  EXPECT_EQ(scene.settings, 30U);
  ASSERT_EQ(scene.on_some.size(), 30U);
  for (std::size_t i = 0; i < 30; ++i) {
    EXPECT_TRUE(scene.on_some[i].on_front[0]);
    EXPECT_EQ(static_cast<bool>(scene.on_some[i].on_front[1]), i != 4) << i;
  }
  EXPECT_NEAR(*scene.on_some[4].behind[1], 1.4 * 1.2 / 1.5 - 1, 1e-9);
  EXPECT_FALSE(scene.on_some[4].may_be[1]);
}

TEST(HardwareTest, drivers_and_backends_are_columns_too) {
  std::vector<FleetRun> runs = {made_run({}), made_run({.driver = "2.0", .cone = 1.1, .seed = 2})};
  HardwareComparison comparison = compare_hardware(runs, {});
  ASSERT_EQ(comparison.columns.size(), 2U);
  EXPECT_EQ(column_text(comparison, 1), "B vulkan GPU 0 (2.0)");
  runs = {made_run({}), made_run({.backend = "opengl", .seed = 2})};
  EXPECT_EQ(compare_hardware(runs, {}).pairs.size(), 1U) << "there are no others";
  runs.push_back(made_run({.device = "GPU 1", .seed = 3}));
  EXPECT_EQ(compare_hardware(runs, {}).pairs.size(), 1U) << "of one backend";
  EXPECT_EQ(compare_hardware(runs, {.across_backends = true}).pairs.size(), 3U);
  const std::vector<FleetRun> one = {made_run({}), made_run({.seed = 2})};
  EXPECT_THROW((void)compare_hardware(one, {}), Error);
}

TEST(HardwareTest, another_scene_matches_nothing_and_is_told) {
  const std::vector<FleetRun> runs = {made_run({}), made_run({.device = "GPU 1", .key = 'b', .seed = 2})};
  const HardwareComparison comparison = compare_hardware(runs, {});
  EXPECT_TRUE(comparison.pairs.empty());
  EXPECT_EQ(exit_of(comparison), Exit::nothing_measured);
  EXPECT_THAT(comparison.warnings,
              ElementsAre(HasSubstr("only one device has the scenes rocks/oblique, rocks/oblique")));
}

TEST(RankCorrelationTest, is_that_of_the_textbook) {
  // Ties share their mean rank: ranks 0, 1.5, 1.5, 3 and 0, 1, 2, 3: covariance 4.5, variances 4.5 and 5.
  const RankCorrelation rank = rank_correlation(std::vector{1.0, 2.0, 2.0, 9.0}, std::vector{1.0, 2.0, 3.0, 4.0}, 0.95);
  EXPECT_NEAR(rank.rho, 4.5 / std::sqrt(4.5 * 5), 1e-12);
  std::vector<double> up;
  for (int i = 0; i < 50; ++i) up.push_back(i);
  const std::vector<double> down(up.rbegin(), up.rend());
  EXPECT_EQ(rank_correlation(up, up, 0.95).rho, 1);
  EXPECT_EQ(rank_correlation(up, down, 0.95).rho, -1);
  EXPECT_EQ(rank_correlation(std::vector{1.0, 1.0}, std::vector{1.0, 2.0}, 0.95).rho, 0) << "no order at all";
}

TEST(RankCorrelationTest, its_interval_covers) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  constexpr double kCorrelation = 0.8;
  // Spearman's of normal variables. source: Pearson, "On further methods of determining correlation", 1907
  const double truth = 6 / M_PI * std::asin(kCorrelation / 2);
  int covered = 0;
  for (int k = 0; k < 500; ++k) {
    std::vector<double> a;
    std::vector<double> b;
    for (int i = 0; i < 40; ++i) {
      a.push_back(normal(random));
      b.push_back(kCorrelation * a.back() + std::sqrt(1 - kCorrelation * kCorrelation) * normal(random));
    }
    const RankCorrelation rank = rank_correlation(a, b, 0.95);
    covered += rank.low <= truth && truth <= rank.high;
  }
  EXPECT_GE(covered, 0.92 * 500);
}

const std::filesystem::path kTables = std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "tests/data";

TEST(HardwareTest, recorded_runs_of_a_processor_and_a_gpu) {
  const TempFolder folder;
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"compare", (kTables / "exhaustive_rocks.csv").string(),
                                          (kTables / "exhaustive_rocks_h200.csv").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_reliefbench(arguments, folder.path());
  };
  CommandResult result = run({});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("times as fast, geometric mean of 1546 cases"));
  EXPECT_THAT(result.out, HasSubstr("order of the settings in rocks/grazing: rank correlation"));
  EXPECT_THAT(result.out, HasSubstr("Of A, B there is one run"));
  result = run({"--json"});
  const nlohmann::json json = nlohmann::json::parse(result.out);
  const nlohmann::json& pair = json.at("pairs").at(0);
  EXPECT_EQ(pair.at("cases").size(), 1546U);
  double logs = 0;
  for (const nlohmann::json& one : pair.at("cases"))
    logs += std::log(one.at("new_ns").get<double>() / one.at("base_ns").get<double>()) / 1546;
  EXPECT_NEAR(pair.at("groups").at(0).at("ratio").get<double>(), std::exp(logs), 1e-9);
  const double rho = pair.at("rank_correlation").at(0).at("spearman");
  EXPECT_GT(rho, 0.5);
  EXPECT_LT(rho, 1);
  EXPECT_THAT(run({"--markdown"}).out, HasSubstr("| B / A | all | 1546 |"));
  EXPECT_EQ(run({"--junit", "file.xml"}).exit_code, 2);
  EXPECT_EQ(run({"--rerun"}).exit_code, 2);
  // The same processor twice beside the GPU: what shifts between its runs is known.
  result = run({(kTables / "exhaustive_rocks_disturbed.csv").string(), "--json"});
  EXPECT_GT(nlohmann::json::parse(result.out).at("columns").at(0).at("between_runs").get<double>(), 0);
  result = run_reliefbench(
      {"compare", (kTables / "exhaustive_rocks.csv").string(), (kTables / "exhaustive_rocks_disturbed.csv").string()},
      folder.path());
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("all runs are of one device and backend, A vulkan llvmpipe"));
}

}  // namespace
}  // namespace reliefbench
