// What a tuning answers where bounds on error and time meet, where nothing is within them, and where settings have no
// value of the error that is searched by.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/command.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tests/written_tables.h"
#include "tuner/plan/setting_space.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// A setting of a made table.
struct MadeSetting {
  std::string technique;
  int steps = 0;
  double time_ms = 1;
  double error = 0;  ///< e_xy.p99
  std::string refinement = "binary";
};

/// The more accurate, the slower; the last has the fewest features.
const std::vector<MadeSetting> kMadeSettings = {{"relief", 4, 1, 8},    {"relief", 8, 2, 0.4},
                                                {"relief", 16, 3, 0.2}, {"relief", 32, 4, 0.05},
                                                {"cone", 8, 2.5, 0.3},  {"relief", 64, 6, 0.1, "none"}};

/// A config of which only settings with a shadow have a value of the error.
constexpr std::string_view kShadowConfig = R"({{
  "scenes": [{{"heightmap": {{"source": "fbm", "width": 32, "height": 32}}, "views": ["oblique"], "frame_px": [32, 32]}}],
  "measure": {{"samples": 3, "batch_ms": 0.5, "warmup_batches_max": 2, "control_every": 2, "block_cases": 4}},
  "front": {{"error": "false_lit_rate", "constraints": []}},
  "sweeps": [
    {{"technique": "flat"}},
    {{"technique": "relief", "axes": {{"linear_steps": {{"from": 4, "to": 16, "times": 2}}, "shadow": [{}]}}}}
  ]
}})";

class TuneBounds : public ::testing::Test {
 protected:
  std::string table(const std::string& name, const std::vector<MadeSetting>& settings,
                    const std::string& device = "GPU") const {
    std::vector<TableRow> rows;
    for (const MadeSetting& made : settings) {
      Settings one(find_technique(made.technique));
      one.set(made.technique == "cone" ? "cone_steps" : "linear_steps", made.steps);
      if (made.technique == "relief") one.set("refinement", made.refinement);
      const double time_ns = made.time_ms * 1e6;
      TableRow row{.case_id = Case{.settings = one, .scene_id = "rocks/top", .backend = "vulkan"}.id(),
                   .settings = one,
                   .map = std::string(map_of(one).id),
                   .backend = "vulkan",
                   .device = device,
                   .scene = "rocks/top",
                   .reason = {},
                   .errors = std::vector<std::optional<double>>(metrics().size(), 0.0),
                   .frame_time = Summary{.median = time_ns, .ci_low = time_ns, .ci_high = time_ns, .n = 12},
                   .samples_ns = {}};
      row.errors[find_metric("e_xy.p99").place] = made.error;
      for (int i = 0; i < 12; ++i) row.samples_ns.push_back(time_ns * (1 + 1e-3 * (i % 5)));
      rows.push_back(std::move(row));
    }
    std::ofstream(folder_ / name) << case_table_csv(rows);
    return (folder_ / name).string();
  }
  [[nodiscard]] TuneResult replay(const std::string& table, const std::vector<std::string>& max_error,
                                  std::optional<double> max_time_ms) const {
    return replay_tune(
        table, "", {.question = {.max_error = parse_budgets(max_error), .max_time_ms = max_time_ms}, .quiet = true});
  }
  [[nodiscard]] CommandResult tune(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"tune", "--quiet"});
    return run_reliefbench(arguments, folder_.path());
  }
  TempFolder folder_;
};

TEST_F(TuneBounds, with_bounds_on_error_and_time_the_pick_is_the_most_accurate_within_both) {
  const TuneResult result = replay(table("table.csv", kMadeSettings), {"e_xy.p99<=0.5"}, 3.5);
  ASSERT_TRUE(result.pick);
  EXPECT_EQ(result.pick->error, 0.2);
  EXPECT_TRUE(result.is_certified());
  for (const TuneRung& rung : result.rungs) EXPECT_LE(rung.high_ns, 3.5e6) << rung.setting;
  EXPECT_EQ(replay(table("table.csv", kMadeSettings), {"e_xy.p99<=0.5"}, {}).pick->error, 0.4);
}

TEST_F(TuneBounds, the_ladder_of_a_bound_on_time_keeps_to_it_and_ends_at_the_pick) {
  const TuneResult result = replay(table("table.csv", kMadeSettings), {}, 3.5);
  ASSERT_TRUE(result.pick);
  EXPECT_EQ(result.pick->error, 0.2);
  ASSERT_FALSE(result.rungs.empty());
  for (const TuneRung& rung : result.rungs) EXPECT_LE(rung.high_ns, 3.5e6) << rung.setting;
  EXPECT_EQ(result.rungs.back().setting, result.pick->setting);
}

TEST_F(TuneBounds, where_nothing_is_as_fast_the_fastest_is_named) {
  const std::string made = table("table.csv", kMadeSettings);
  const TuneResult result = replay(made, {}, 0.5);
  EXPECT_FALSE(result.pick);
  EXPECT_THAT(result.nearest, HasSubstr("linear_steps=4&"));
  EXPECT_THAT(result.miss, AllOf(HasSubstr("the fastest takes up to 1.0"), HasSubstr(" ms where 0.5 ms is asked")));
  const CommandResult told = tune({"--replay", made, "--max-time-ms", "0.5"});
  EXPECT_EQ(told.exit_code, 1);
  EXPECT_THAT(told.out, AllOf(HasSubstr("no pick: the fastest takes"), HasSubstr("nearest: relief linear_steps=4")));
}

// Two settings of the same samples: no number of them says which is faster by so little.
TEST_F(TuneBounds, a_replay_that_is_never_certain_ends) {
  const std::string made = table("table.csv", {{"relief", 4, 1, 0.1}, {"relief", 8, 1, 0.1}});
  const CommandResult told = tune({"--replay", made, "--epsilon", "1e-9"});
  EXPECT_EQ(told.exit_code, 4) << told.err;
  EXPECT_THAT(told.out, HasSubstr("pick relief"));
}

TEST_F(TuneBounds, where_nothing_meets_the_budget_the_most_accurate_is_named) {
  const TuneResult result = replay(table("table.csv", {{"relief", 4, 1, 8}, {"relief", 8, 2, 0.75}}), {}, {});
  EXPECT_FALSE(result.pick);
  EXPECT_THAT(result.nearest, HasSubstr("linear_steps=8&"));
  EXPECT_EQ(result.miss, "e_xy.p99 is 0.75 where 0.5 is asked");
}

TEST_F(TuneBounds, a_fleet_that_no_setting_does_for_is_a_no) {
  const std::string here = table("here.csv", {{"relief", 4, 1, 0.1}, {"relief", 8, 2, 0.1}});
  const std::string there = table("there.csv", {{"cone", 4, 1, 0.1}, {"cone", 8, 2, 0.1}}, "another GPU");
  const CommandResult told = tune({"--replay", here, "--fleet", there});
  EXPECT_THAT(told.out, HasSubstr("no setting for all devices: "));
  EXPECT_EQ(told.exit_code, 1);
}

TEST_F(TuneBounds, a_setting_without_a_value_of_the_error_is_no_answer) {
  std::ofstream(folder_ / "config.json") << fmt::format(kShadowConfig, R"("none", "linear")");
  const CommandResult result = tune({"config.json", "--backend", "null", "-o", "tuned", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json told = nlohmann::json::parse(result.out);
  EXPECT_THAT(told.at("pick").at("setting").get<std::string>(), HasSubstr("shadow=linear"));
  EXPECT_EQ(told.at("settings").size(), 3U);
  EXPECT_EQ(told.at("space").at("settings"), 7);
  EXPECT_THAT(tune({"config.json", "--backend", "null", "-o", "tuned"}).out,
              HasSubstr("4 have no value of false_lit_rate"));
}

TEST_F(TuneBounds, where_no_setting_has_a_value_there_is_no_pick) {
  std::ofstream(folder_ / "config.json") << fmt::format(kShadowConfig, R"("none")");
  const CommandResult result = tune({"config.json", "--backend", "null", "-o", "tuned"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("no pick: no setting has a value of false_lit_rate"), Not(HasSubstr("flat"))));
}

TEST_F(TuneBounds, what_a_held_out_scene_did_not_measure_is_no_number) {
  TuneResult result{.scenes = {"a"}, .scene_keys = {SceneKey{}}};
  result.holdout.push_back({.scene = "b", .scene_key = SceneKey{std::string(64, 'a')}});
  const nlohmann::json told = tune_json(result);
  EXPECT_TRUE(told.at("holdout")[0].at("error").is_null());
  EXPECT_EQ(schema_errors(told, "tune"), "");
}

}  // namespace
}  // namespace reliefbench
