// One table of quality levels for a fleet: by enumeration, and as whoever reads presets finds it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tests/schema.h"
#include "tests/written_run.h"
#include "tuner/decide/presets.h"
#include "tuner/plan/preset_file.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;

/// A run whose cones take `cone` times as long as usual.
Run made_device(const std::string& device, double cone) {
  Run run = sampled_run({.folder = "out/" + device,
                         .device = device,
                         .backends = {"vulkan"},
                         .scenes = {"rocks/oblique"},
                         .with_failed = false});
  run.info["budgets"] = {"e_xy.p99<=100"};
  run.info["front"] = {{"error", "e_xy.p99"}, {"constraints", {"missed_rate<=1"}}};
  for (Sample& sample : run.samples)
    if (sample.case_id.text().find("cone") != std::string::npos) sample.frame_time_ns *= cone;
  return run;
}

class PresetsCommonTest : public ::testing::Test {
 protected:
  PresetsCommonTest() {
    runs_.push_back(made_device("GPU A", 1));
    runs_.push_back(made_device("GPU B", 3));
    for (const auto& run : runs_)
      fleet_.push_back({.name = run.folder.string(), .rows = case_table(run), .info = run.info});
  }
  std::vector<reliefbench::Run> runs_;
  std::vector<FleetRun> fleet_;
};

TEST_F(PresetsCommonTest, each_level_is_the_fleets_choice_and_levels_keep_their_order) {
  const PresetQuery query{.error_metric = "e_xy.p99"};
  const Presets presets = make_common_presets(runs_, fleet_, query, Regret::minimax);
  ASSERT_TRUE(presets.common);
  const std::vector<CommonLevel>& levels = presets.common->levels;
  ASSERT_GE(levels.size(), 3U);
  EXPECT_EQ(levels.front().quality, 0);
  const Fleet all = choose_for_fleet(fleet_, {.budgets = presets.constraints});
  const std::size_t metric = find_metric("e_xy.p99").place;
  const auto error_of = [&](const FleetSetting& one) {
    return std::max(*one.losses[0].row->errors[metric], *one.losses[1].row->errors[metric]);
  };
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const CommonLevel& level = levels[i];
    if (i > 0) {
      EXPECT_LE(level.level_error, levels[i - 1].level_error);
      for (std::size_t p = 0; p < 2; ++p) EXPECT_GE(level.losses[p].time_ns, levels[i - 1].losses[p].time_ns);
    }
    // Whatever is as accurate, keeps the order and is nowhere slower than the pick does not exist.
    for (const FleetSetting& one : all.settings) {
      const bool is_faster = one.losses[0].time_ns < 0.999 * level.losses[0].time_ns &&
                             one.losses[1].time_ns < 0.999 * level.losses[1].time_ns;
      EXPECT_FALSE(is_faster && error_of(one) <= level.level_error &&
                   (i + 1 == levels.size() || error_of(one) >= levels[i + 1].level_error))
          << level.quality << ' ' << setting_id(one.settings);
    }
  }
  // The best level is the fleet's choice among all that are as accurate.
  std::vector<Budget> budgets = presets.constraints;
  budgets.push_back({"e_xy.p99", level_limit(error_of(all.settings.front()), 0, 100, presets)});
  const Fleet best = choose_for_fleet(fleet_, {.budgets = budgets});
  EXPECT_EQ(levels.back().losses[0].row->settings, best.settings.front().settings);
}

TEST_F(PresetsCommonTest, what_has_no_value_of_the_error_is_no_level) {
  fleet_.clear();
  for (auto& run : runs_) {
    const auto fastest = std::ranges::min_element(
        run.records, {}, [](const Record& record) { return record.frame_time->summary.median; });
    for (Record& record : run.records) (*record.error)["flip"] = std::min(1.0, record.error->at("e_xy.p99") / 100);
    (*fastest->error)["flip"] = std::nullopt;
    fleet_.push_back({.name = run.folder.string(), .rows = case_table(run), .info = run.info});
  }
  const Presets presets = make_common_presets(runs_, fleet_, {}, Regret::minimax);
  EXPECT_EQ(presets.level_metric, "flip");
  EXPECT_GE(presets.common->levels.size(), 3U);
  EXPECT_TRUE(presets.warnings.empty());
  for (const CommonLevel& level : presets.common->levels) EXPECT_LE(level.level_error, 1);
  EXPECT_EQ(schema_errors(presets_json(presets), "presets"), "");
}

TEST_F(PresetsCommonTest, few_levels_are_warned_of) {
  fleet_.clear();
  for (auto& run : runs_) {
    run.records.resize(1);
    fleet_.push_back({.name = run.folder.string(), .rows = case_table(run), .info = run.info});
  }
  const Presets presets = make_common_presets(runs_, fleet_, {.error_metric = "e_xy.p99"}, Regret::minimax);
  ASSERT_EQ(presets.warnings.size(), 1U);
  EXPECT_THAT(presets.warnings.front(), HasSubstr("2 places: 1 distinct level of 1 settings within "));
}

TEST_F(PresetsCommonTest, every_device_has_the_same_settings_in_the_file) {
  const Presets presets = make_common_presets(runs_, fleet_, {.error_metric = "e_xy.p99"}, Regret::minimax);
  const nlohmann::json json = presets_json(presets);
  EXPECT_EQ(schema_errors(json, "presets"), "");
  ASSERT_EQ(json.at("devices").size(), 2U);
  EXPECT_EQ(json.at("common").at("places").size(), 2U);
  const std::vector<LoadedPreset> loaded = parse_presets(json.dump(1), "presets.json");
  for (const int quality : {0, 50, 100}) {
    const LoadedPreset& a = choose_preset(loaded, {.quality = quality, .device = "GPU A"}, "presets.json");
    const LoadedPreset& b = choose_preset(loaded, {.quality = quality, .device = "GPU B"}, "presets.json");
    EXPECT_EQ(a.settings, b.settings);
  }
  EXPECT_THAT(presets_header(presets), HasSubstr("RELIEF_VULKAN_GPU_B_Q50_TECHNIQUE"));
}

TEST_F(PresetsCommonTest, the_command_writes_and_says_it) {
  const TempFolder folder;
  for (auto& run : runs_) {
    run.folder = folder / run.folder.filename();
    write_run(run);
  }
  const CommandResult result = run_reliefbench({"presets", runs_[0].folder.string(), runs_[1].folder.string(),
                                                "--common", "--error", "e_xy.p99", "-o", "presets.json"},
                                               folder.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("One table for 2 places"));
  EXPECT_THAT(result.out, HasSubstr("B: vulkan GPU B in rocks/oblique"));
  EXPECT_TRUE(nlohmann::json::parse(file_text(folder / "presets.json")).contains("common"));
}

}  // namespace
}  // namespace reliefbench
