#include "tuner/decide/presets.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <map>
#include <set>

#include "backends/shader_compiler.h"
#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "tests/finished_run.h"
#include "tests/made_score.h"
#include "tests/schema.h"
#include "tuner/decide/pareto.h"
#include "tuner/plan/plan.h"
#include "tuner/results/case_table.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// One setting's figures in one scene.
struct Figures {
  int linear_steps;
  double time_ms;
  double error;
};

/// A run of `relief` with just these figures, by scene.
Run run_of(const std::map<std::string, std::vector<Figures>>& scenes) {
  Run run = synthetic_run({.cases = 1, .with_failed = false});
  run.records.clear();
  run.scenes.clear();
  run.info["budgets"] = {"e_xy.p99<=10"};
  for (const auto& [scene, list] : scenes) {
    run.scenes.push_back(synthetic_scene(scene));
    for (const auto& [steps, time_ms, error] : list) {
      Settings settings(find_technique("relief"));
      settings.set("linear_steps", steps);
      Record record;
      record.technique = "relief";
      for (const Param& param : settings.technique().params)
        if (settings.is_active(param)) record.params.emplace_back(param.id, param.text(settings.get(param.id)));
      record.case_id = fmt::format("relief@{}?{}&backend=opengl", scene, settings.text());
      record.scene = scene;
      record.scene_key = synthetic_scene(scene).key;
      record.backend = "opengl";
      record.device = "GPU";
      const double time_ns = time_ms * 1e6;
      record.frame_time =
          FrameTime{.summary = {.median = time_ns, .mad = 0, .ci_low = time_ns, .ci_high = time_ns, .n = 7},
                    .raw_median = time_ns,
                    .timer = "fenced_wall"};
      record.error = made_score();
      (*record.error)["e_xy.p99"] = error;
      run.records.push_back(record);
    }
  }
  return run;
}

std::vector<std::string> steps_of(const DevicePresets& device) {
  std::vector<std::string> steps;
  for (const PresetLevel& level : device.levels) steps.push_back(level.evidence.front().record->params[0].second);
  return steps;
}

TEST(Presets, of_one_scene_go_from_end_to_end_of_its_front) {
  std::vector<reliefbench::Run> runs;
  Presets presets;
  std::uint32_t seed = 0;
  do {  // until the fronts that are made up have something to choose from
    runs = {synthetic_run({.scenes = {"rocks/grazing"}, .cases = 600, .seed = ++seed})};
    presets = make_presets(runs, {});
  } while (seed < 100 &&
           std::ranges::any_of(presets.devices, [](const DevicePresets& device) { return device.levels.size() < 3; }));
  const std::vector<Budget> bounds = {{"missed_rate", 0.001}, {"e_xy.p99", 0.5}};
  const std::vector<Front> all = fronts(runs[0].records, "e_xy.p99", bounds);
  ASSERT_EQ(presets.devices.size(), 2U);
  for (std::size_t d = 0; d < 2; ++d) {
    const DevicePresets& device = presets.devices[d];
    ASSERT_GE(device.levels.size(), 3U);
    EXPECT_EQ(device.levels.front().quality, 0);
    // Within the run's budget, however much faster what errs by 30 texels is.
    EXPECT_LE(device.levels.front().error, 0.5);
    EXPECT_LE(device.levels.back().error, std::max(all[d].points.back().error, 0.02 * all[d].points.front().error));
    EXPECT_LT(device.levels.front().relative_time, 1.1);  // the fastest, or a simpler one that ties with it
    for (std::size_t i = 1; i < device.levels.size(); ++i) {
      EXPECT_GT(device.levels[i].quality, device.levels[i - 1].quality);
      EXPECT_EQ(device.levels[i].quality % 10, 0);
      EXPECT_NE(device.levels[i].evidence[0].record, device.levels[i - 1].evidence[0].record);
      EXPECT_GE(device.levels[i].relative_time, device.levels[i - 1].relative_time);
      EXPECT_LE(device.levels[i].error, device.levels[i - 1].error);
    }
  }
  EXPECT_EQ(schema_errors(presets_json(presets), "presets"), "");
  nlohmann::json bad = presets_json(presets);
  bad["devices"][0]["levels"][0].erase("evidence");
  EXPECT_NE(schema_errors(bad, "presets"), "");
}

std::vector<int> qualities(const DevicePresets& device) {
  std::vector<int> list;
  for (const PresetLevel& level : device.levels) list.push_back(level.quality);
  return list;
}

TEST(Presets, levels_are_equal_ratios_of_the_error_and_equal_ones_are_merged) {
  // Of 1 down to .02, a step of 10 in quality divides the error by 1.48.
  const reliefbench::Run run =
      run_of({{"s", {{1, 1, 1}, {2, 2, 0.5}, {3, 4, 0.25}, {4, 8, 0.125}, {5, 16, 0.0625}, {6, 32, 0.02}}}});
  const Presets presets = make_presets({&run, 1}, {});
  EXPECT_EQ(presets.level_metric, "e_xy.p99");
  EXPECT_EQ(steps_of(presets.devices[0]), (std::vector<std::string>{"1", "2", "3", "4", "5", "6"}));
  EXPECT_EQ(qualities(presets.devices[0]), (std::vector<int>{0, 10, 20, 40, 60, 80}));
  EXPECT_TRUE(presets.warnings.empty());
}

TEST(Presets, what_is_not_seen_is_not_paid_for) {
  // A fiftieth of the loosest error is none: the last two cost more for nothing.
  const reliefbench::Run run = run_of({{"s", {{1, 1, 1}, {2, 2, 0.1}, {3, 3, 0.015}, {4, 9, 0.0001}, {5, 99, 0}}}});
  EXPECT_EQ(steps_of(make_presets({&run, 1}, {}).devices[0]), (std::vector<std::string>{"1", "2", "3"}));
}

TEST(Presets, levels_are_equal_steps_of_flip_where_pictures_were_compared) {
  reliefbench::Run run = run_of({{"s", {{1, 1, 1}, {2, 2, 0.9}, {3, 4, 0.8}, {4, 8, 0.7}}}});
  const std::vector<double> flips = {0.10, 0.06, 0.05, 0.0};
  for (std::size_t i = 0; i < flips.size(); ++i) (*run.records[i].error)["flip"] = flips[i];
  const Presets presets = make_presets({&run, 1}, {});
  EXPECT_EQ(presets.level_metric, "flip");
  EXPECT_EQ(presets.error_metric, "e_xy.p99");
  EXPECT_EQ(steps_of(presets.devices[0]), (std::vector<std::string>{"1", "2", "3", "4"}));
  EXPECT_EQ(qualities(presets.devices[0]), (std::vector<int>{0, 10, 50, 60}));
  EXPECT_EQ(presets.devices[0].levels[1].level_error, 0.06);
  EXPECT_EQ(presets.devices[0].levels[1].error, 0.9);
  EXPECT_EQ(schema_errors(presets_json(presets), "presets"), "");
  EXPECT_EQ(make_presets({&run, 1}, {.error_metric = "e_xy.p99"}).level_metric, "e_xy.p99");
}

TEST(Presets, what_has_no_value_of_what_is_seen_is_no_level) {
  reliefbench::Run run = run_of({{"s", {{1, 1, 1}, {2, 2, 0.9}, {3, 4, 0.8}, {4, 8, 0.7}}}});
  const std::vector<std::optional<double>> flips = {std::nullopt, 0.06, 0.05, 0.0};
  for (std::size_t i = 0; i < flips.size(); ++i) (*run.records[i].error)["flip"] = flips[i];
  EXPECT_EQ(steps_of(make_presets({&run, 1}, {}).devices[0]), (std::vector<std::string>{"2", "3", "4"}));
}

TEST(Presets, levels_keep_to_the_budget_of_the_run) {
  reliefbench::Run run = run_of({{"s", {{1, 1, 495}, {2, 2, 0.4}, {3, 4, 0.1}, {4, 8, 0.01}}}});
  run.info["budgets"] = {"e_xy.p99<=0.5"};
  EXPECT_EQ(make_presets({&run, 1}, {}).devices[0].levels.front().error, 0.4);
  run.info["identity"]["tune"] = {{"max_error", {"e_xy.p99<=0.2"}}};  // what a tune was asked
  EXPECT_EQ(make_presets({&run, 1}, {}).devices[0].levels.front().error, 0.1);
  const Presets all = make_presets({&run, 1}, {.constraints = {{{"e_xy.p99", 1000}}}});
  EXPECT_EQ(all.devices[0].levels.front().error, 495);
}

TEST(Presets, few_levels_are_warned_of) {
  reliefbench::Run run = run_of({{"s", {{1, 1, 0}}}});
  const Presets one = make_presets({&run, 1}, {});
  EXPECT_EQ(qualities(one.devices[0]), std::vector<int>{0});
  ASSERT_EQ(one.warnings.size(), 1U);
  EXPECT_THAT(one.warnings[0], AllOf(HasSubstr("1 distinct level of 1 settings"), HasSubstr("sweep more settings")));
  EXPECT_EQ(schema_errors(presets_json(one), "presets"), "");
  run.info["identity"]["tune"] = {{"max_error", nlohmann::json::array()}};
  EXPECT_THAT(make_presets({&run, 1}, {}).warnings.at(0), HasSubstr("tune"));
}

TEST(Presets, of_settings_that_tie_the_simplest_is_a_level) {
  reliefbench::Run run = run_of({{"s", {{1, 1.0, 1}, {2, 1.1, 1}}}});
  run.records[1].params = run.records[0].params;  // the same but without a feature
  run.records[1].params[0].second = "2";
  std::erase_if(run.records[1].params, [](const auto& p) { return p.first == "binary_steps"; });
  for (auto& [id, value] : run.records[1].params)
    if (id == "refinement") value = "none";
  EXPECT_EQ(steps_of(make_presets({&run, 1}, {}).devices[0]).front(), "1");
  run.records[0].frame_time->summary.ci_high = 1.15e6;  // which now overlaps
  EXPECT_EQ(steps_of(make_presets({&run, 1}, {}).devices[0]).front(), "2");
}

TEST(Presets, a_setting_counts_as_in_its_worst_scene) {
  // In `b` two steps are slower than three and no better: relative to a's fastest 2 and to b's 5, error 0.5.
  const reliefbench::Run run =
      run_of({{"a", {{1, 1, 1}, {2, 2, 0.1}, {3, 3, 0.2}}}, {"b", {{1, 10, 2}, {2, 50, 0.5}, {3, 20, 0.3}}}});
  const DevicePresets device = make_presets({&run, 1}, {}).devices[0];
  EXPECT_EQ(device.on_front, 2);
  EXPECT_EQ(device.levels.front().error, 2);
  EXPECT_EQ(device.levels.back().error, 0.3);
  EXPECT_EQ(device.levels.back().relative_time, 3);
  ASSERT_EQ(device.levels.back().evidence.size(), 2U);
  EXPECT_EQ(device.levels.back().evidence[0].record->scene, "a");
  EXPECT_EQ(device.levels.back().evidence[1].error, 0.3);
}

TEST(Presets, of_two_runs_the_later_measurement_counts) {
  const std::vector<reliefbench::Run> runs = {run_of({{"s", {{1, 1, 1}, {2, 2, 0.1}}}}),
                                              run_of({{"s", {{2, 4, 0.1}, {3, 9, 0.01}}}})};
  const Presets presets = make_presets(runs, {});
  EXPECT_EQ(presets.devices[0].measured, 3);
  EXPECT_EQ(presets.devices[0].levels.back().relative_time, 9);
  for (const PresetLevel& level : presets.devices[0].levels) EXPECT_NE(level.relative_time, 2);
  EXPECT_EQ(presets_json(presets)["devices"][0]["levels"].back()["evidence"][0]["run"], 1);
}

TEST(Presets, what_makes_no_table_is_refused) {
  const auto fails = [](const std::vector<reliefbench::Run>& runs, const auto& words, const PresetQuery& query = {}) {
    EXPECT_THAT([&] { (void)make_presets(runs, query); }, ThrowsMessage<Error>(words));
  };
  const reliefbench::Run good = run_of({{"s", {{1, 1, 1}}}});
  fails({run_of({{"a", {{1, 1, 1}}}, {"b", {{2, 1, 1}}}})},
        AllOf(HasSubstr("opengl, GPU: no setting was measured in all of its 2 scenes"), HasSubstr("a: 1, b: 1")));
  reliefbench::Run other = good;
  other.records[0].scene_key = synthetic_scene("another").key;
  fails({good, other}, HasSubstr("scene 's' is not the same"));
  other = good;
  other.info["devices"][0]["driver"] = "synthetic 2.0";
  fails({good, other}, HasSubstr("its driver is 'synthetic 1.0'"));
  other = good;
  other.info["host"]["cpu"] = "Another CPU";  // which is what draws
  fails({good, other}, HasSubstr("it draws on 'Synthetic CPU' in"));
  other = good;
  other.info["front"]["error"] = "flip";
  fails({good, other}, HasSubstr("its front's error is flip"));
  EXPECT_NO_THROW((void)make_presets(std::vector<reliefbench::Run>{good, other}, {.error_metric = "e_xy.p99"}));
  other = good;
  other.info["budgets"] = {"e_xy.p99<=0.25"};
  fails({good, other}, HasSubstr("its budget is 'e_xy.p99<=0.25', that of"));
  EXPECT_NO_THROW((void)make_presets(std::vector<reliefbench::Run>{good, other}, {.constraints = {{}}}));
  fails({good}, HasSubstr("higher is better"), {.error_metric = "psnr"});
  other = good;
  other.records[0].status = Status::throttled;
  fails({other}, HasSubstr("no case that was measured"));
  try {
    (void)make_presets({&good, 1}, {.constraints = {{{"e_xy.p99", 0.5}}}});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::answer_is_no);
    EXPECT_THAT(error.what(), HasSubstr("e_xy.p99<=0.5"));
  }
}

TEST(Presets, the_header_is_cpp_and_glsl) {
  const TempFolder folder;
  const std::vector<reliefbench::Run> runs = {
      synthetic_run({.device = "Hostile\\\n__GPU (1.2) \xc3\xa9 \\", .scenes = {"rocks/grazing"}, .cases = 200})};
  const Presets presets = make_presets(runs, {});
  const std::string header = presets_header(presets);
  EXPECT_EQ(header.find("__"), header.find("__GPU"));  // in a comment alone
  const std::string own = "RELIEF_OPENGL_HOSTILE_GPU_1_2_Q50_TECHNIQUE";
  const std::vector<PresetLevel>& levels = presets.devices[0].levels;
  const auto above = std::ranges::find_if(levels, [](const PresetLevel& level) { return level.quality > 50; });
  const std::string technique = std::prev(above)->evidence[0].record->technique;
  std::size_t index = 0;
  while (techniques()[index].id != technique) ++index;

  write_atomically(folder / "presets.h", header);
  write_atomically(
      folder / "use.cpp",
      fmt::format("#include \"presets.h\"\n#include \"presets.h\"\nstatic_assert({} == {});\n", own, index));
  const std::string command =
      fmt::format("c++ -std=c++20 -Wall -Wextra -Wpedantic -Werror -fsyntax-only {}", (folder / "use.cpp").string());
  EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe)

  const std::string glsl = header + fmt::format(
                                        "#if {} != {}\n#error not the technique\n#endif\nHit trace(Ray ray) {{ return "
                                        "Hit(float({}), STATUS_HIT, 0, 0); }}\n",
                                        own, index, own);
  for (const Dialect dialect : {Dialect::opengl, Dialect::vulkan})
    EXPECT_NO_THROW((void)compile_fragment({.name = "presets.glsl", .text = glsl}, Target::score, dialect));
}

class PresetsInConfig : public ::testing::Test {
 protected:
  PresetsInConfig() {
    const std::vector<reliefbench::Run> runs = {load_run(null_sweep(folder_))};
    presets_ = presets_json(make_presets(runs, {}));
  }
  Config config(const std::string& sweep) {
    write_atomically(folder_ / "presets.json", presets_.dump(1));
    const std::string text = R"({"scenes": [{"heightmap": "fbm", "views": "top"}], "sweeps": [)" + sweep + "]}";
    EXPECT_EQ(schema_errors(nlohmann::json::parse(text), "config"), "");
    return parse_config(text, folder_ / "config.json");
  }
  void refused(const std::string& sweep, const std::string& words) {
    EXPECT_THAT([&] { (void)config(sweep); }, ThrowsMessage<Error>(HasSubstr(words))) << sweep;
  }
  TempFolder folder_;
  nlohmann::json presets_;
};

TEST_F(PresetsInConfig, every_level_becomes_a_case) {
  const std::vector<std::string> backends = {"null"};
  const Config all = config(R"({"presets": "presets.json"})");
  EXPECT_EQ(all.sweeps.size(), presets_["devices"][0]["levels"].size());
  EXPECT_EQ(all.included.size(), 1U);
  EXPECT_LE(make_plan(all, backends, "").cases.size(), all.sweeps.size());
  const Config some =
      config(R"({"presets": "presets.json", "quality": [0, 100], "device": "null"}, {"technique": "flat"})");
  ASSERT_EQ(some.sweeps.size(), 3U);
  const Plan plan = make_plan(some, backends, "");
  const nlohmann::json& level = presets_["devices"][0]["levels"].back();
  std::set<std::string> texts;
  for (const Case& c : plan.cases) texts.insert(std::string(c.settings.technique().id) + "?" + c.settings.text());
  std::vector<std::pair<std::string, std::string>> params;
  for (const auto& item : level["params"].items()) params.emplace_back(item.key(), item.value());
  EXPECT_TRUE(texts.contains(level["technique"].get<std::string>() + "?" +
                             settings_of(level["technique"].get<std::string>(), params).text()));
}

TEST_F(PresetsInConfig, a_quality_between_two_levels_is_the_lower) {
  const nlohmann::json& levels = presets_["devices"][0]["levels"];
  ASSERT_GE(levels.size(), 3U);
  const int second = levels[1]["quality"];
  const auto sweeps = [&](int quality) {
    return config(fmt::format(R"({{"presets": "presets.json", "quality": {}}})", quality)).sweeps;
  };
  ASSERT_EQ(sweeps(second + 5).size(), 1U);
  EXPECT_EQ(sweeps(second + 5)[0].axes.size(), sweeps(second)[0].axes.size());
  EXPECT_EQ(sweeps(second - 1)[0].technique, sweeps(0)[0].technique);
  const std::vector<LoadedPreset> loaded = parse_presets(presets_.dump(1), "p.json");
  EXPECT_EQ(choose_preset(loaded, {.quality = second + 5}, "p.json").quality, second);
  EXPECT_EQ(choose_preset(loaded, {.quality = second - 1}, "p.json").quality, 0);
  EXPECT_EQ(choose_preset(loaded, {.quality = 100}, "p.json").quality, levels.back()["quality"]);
  EXPECT_THROW((void)choose_preset(loaded, {.quality = 101}, "p.json"), Error);
  EXPECT_THROW((void)choose_preset(loaded, {.quality = -1}, "p.json"), Error);
}

TEST_F(PresetsInConfig, what_is_unknown_is_named_with_file_and_key) {
  refused(R"({"presets": "none.json"})", "config.json:1: key 'sweeps[0].presets'");
  refused(R"({"presets": "presets.json", "device": "nul"})", "did you mean 'null'?");
  const nlohmann::json good = presets_;
  const auto broken = [&](const char* pointer, const nlohmann::json& value, const std::string& words) {
    presets_ = good;
    presets_[nlohmann::json::json_pointer(pointer)] = value;
    refused(R"({"presets": "presets.json"})", words);
  };
  broken("/devices/0/levels/1/technique", "cane", "key 'devices[0].levels[1].technique': technique 'cane' is unknown");
  broken("/devices/0/levels/1/params/colour", "red", "key 'devices[0].levels[1].params.colour'");
  broken("/devices/0/levels/0/params", nlohmann::json::object({{"format", "r9"}}), "presets.json:");
  broken("/devices/0/levels/0/quality", 101, "key 'devices[0].levels[0].quality'");
  broken("/schema", 1, "key 'schema': is 1, this reliefbench reads 2; make the presets anew");
  broken("/scenes/0/tiling", 3, "presets.json:");
  broken("/devices/0/levels/0/evidence/0/scene_key", std::string(64, '0'), "no scene of the file has the key 00000000");
  EXPECT_THROW((void)parse_config(R"({"scenes": [{"heightmap": "fbm", "views": "top"}],
                                      "sweeps": [{"presets": "presets.json", "technique": "cone"}]})",
                                  folder_ / "c.json"),
               Error);
}

}  // namespace
}  // namespace reliefbench
