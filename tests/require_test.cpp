// What a scene requires: the search over sets of features, the sets that rows make, three scenes on devices, the
// command.
#include "tuner/decide/require.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "kernels/base/error.h"
#include "kernels/image/image.h"
#include "tests/command.h"
#include "tests/faulty_device.h"
#include "tests/own_cache.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tuner/measure/require_space.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;

/// displacement, shadow over it, penumbra over that; normals beside all.
FeatureSpace made_space() {
  FeatureSpace space{.features = {"displacement", "shadow", "penumbra", "normals"}, .sets = {}};
  for (FeatureSet set = 0; set < 16; ++set)
    if ((!has(set, 1) || has(set, 0)) && (!has(set, 2) || has(set, 1))) space.sets.push_back(set);
  return space;
}

/// What is missing adds up.
SetError added(std::vector<double> missing) {
  return [missing = std::move(missing)](FeatureSet set) {
    double error = 0;
    for (std::size_t i = 0; i < missing.size(); ++i) error += has(set, i) ? 0 : missing[i];
    return error;
  };
}

TEST(Require, finds_the_smallest_set_that_nobody_sees) {
  const FeatureSpace space = made_space();
  ASSERT_EQ(space.sets.size(), 8U);
  const auto smallest = [&](std::vector<double> missing, double limit) {
    return require_by_enumeration(space, added(std::move(missing)), limit).smallest;
  };
  EXPECT_THAT(smallest({0.5, 0.1, 0.001, 0.002}, 0.01), ElementsAre(0b0011U));  // penumbra and normals may go
  EXPECT_THAT(smallest({0.5, 0.1, 0.05, 0.002}, 0.01), ElementsAre(0b0111U));
  EXPECT_THAT(smallest({0.001, 0.001, 0.001, 0.001}, 0.01), ElementsAre(0U));
  EXPECT_THAT(smallest({0.001, 0.001, 0.02, 0.001}, 0.01), ElementsAre(0b0111U));  // what carries it stays
  EXPECT_THAT(smallest({0.02, 0, 0, 0.02}, 0.03), ElementsAre(1U, 0b1000U));       // either
  const SetError everywhere = [](FeatureSet) { return 1.0; };
  EXPECT_THAT(require_by_enumeration(space, everywhere, 0.01).smallest, IsEmpty());
  EXPECT_THAT(require_greedily(space, everywhere, 0.01).smallest, IsEmpty());
}

TEST(Require, leaves_out_what_takes_something_away) {
  // A feature that harms: everything on is not the best there is.
  const SetError error = [](FeatureSet set) { return (has(set, 0) ? 0 : 0.3) + (has(set, 3) ? 0.1 : 0); };
  EXPECT_THAT(require_greedily(made_space(), error, 0.05).smallest, ElementsAre(1U));
}

TEST(Require, greedily_finds_what_enumeration_finds_and_looks_at_fewer_sets) {
  FeatureSpace space{.features = {"a", "b", "c", "d", "e", "f", "g"}, .sets = {}};
  for (FeatureSet set = 0; set < 128; ++set)
    if (!has(set, 1) || has(set, 0)) space.sets.push_back(set);
  std::mt19937 random(1);
  std::exponential_distribution<double> missing(100);
  int same = 0;
  for (int i = 0; i < 100; ++i) {
    std::vector<double> each;
    for (std::size_t j = 0; j < space.features.size(); ++j) each.push_back(missing(random));
    const Required all = require_by_enumeration(space, added(each), 0.02);
    const Required few = require_greedily(space, added(each), 0.02);
    ASSERT_FALSE(few.smallest.empty());
    EXPECT_LT(few.judged.size(), all.judged.size() / 2);
    same += size_of(few.smallest.front()) == size_of(all.smallest.front()) ? 1 : 0;
  }
  EXPECT_GE(same, 97);
}

TEST(Require, holds_an_answer_against_its_neighbours) {
  const FeatureSpace space = made_space();
  EXPECT_EQ(largest_without(space, 0b1111, 0), 0b1000U);  // without displacement there is no shadow either
  EXPECT_EQ(largest_without(space, 0b0111, 2), 0b0011U);
  EXPECT_EQ(smallest_with(space, 0, 2), 0b0111U);
  EXPECT_EQ(smallest_with(space, 0b0001, 3), 0b1001U);
  EXPECT_EQ(smallest_with({.features = {"a"}, .sets = {0}}, 0, 0), std::nullopt);
}

SceneFile file_of(const std::string& more = "") {
  return parse_scene_file(R"({"scenes": {"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique",
                              "frame_px": [8, 8]})" +
                              more + "}",
                          "s.json");
}

TEST(RequireSpace, is_what_the_rows_say) {
  std::vector<TriedRow> tried;
  const auto value = [](const Settings& s) {
    return s.is("shadow", "cone") || s.is("shadow", "soft_taps") ? 0.1 : 0.2;
  };
  const SettingSpace made = setting_space(file_of(), value, tried);
  EXPECT_THAT(made.space.features, IsSupersetOf({"displacement", "shadow", "penumbra", "lod", "fade", "normals"}));
  EXPECT_THAT(made.choices, IsSupersetOf({"cone", "shadow=cone", "shadow=soft_taps", "lod=footprint"}));
  int chosen = 0;
  for (const TriedRow& row : tried) chosen += row.is_chosen ? 1 : 0;
  EXPECT_EQ(static_cast<std::size_t>(chosen) + 1, made.space.features.size());  // one row each, and the technique
  std::set<FeatureSet> sets(made.space.sets.begin(), made.space.sets.end());
  EXPECT_EQ(sets.size(), made.space.sets.size());
  for (const auto& [set, settings] : made.settings) {
    EXPECT_EQ(settings.technique().reads_map(), has(set, 0));
    EXPECT_EQ(settings.is("shadow", "soft_taps"), has(set, 2)) << settings.text();
    EXPECT_EQ(settings.is("shadow", "cone"), has(set, 1) && !has(set, 2)) << settings.text();
    EXPECT_EQ(conflict(settings), "");
  }
}

TEST(RequireSpace, has_the_rows_that_the_scene_allows) {
  std::vector<TriedRow> tried;
  const SceneFile file = file_of(R"(, "setting": "relief?linear_steps=8",
                   "features": {"shadow": ["cone", "linear"], "lod": [], "fade": [], "normals": []})");
  const SettingSpace made = setting_space(
      file, [](const Settings&) { return 0.0; }, tried);
  EXPECT_THAT(made.space.features, ElementsAre("displacement", "shadow"));  // a height map has no cones
  EXPECT_THAT(made.choices, ElementsAre("relief", "shadow=linear"));
  EXPECT_THAT(made.space.sets, ElementsAre(0U, 1U, 3U));
}

// Else the displacement's price would hold what compute shaders cost.
TEST(RequireSpace, displaces_nothing_by_the_settings_own_dispatch) {
  std::vector<TriedRow> tried;
  for (const std::string dispatch : {"fragment", "compute"}) {
    const SceneFile file = file_of(fmt::format(R"(, "setting": "relief?dispatch={}")", dispatch));
    const SettingSpace made = setting_space(
        file, [](const Settings&) { return 0.0; }, tried);
    for (const auto& [set, settings] : made.settings) EXPECT_EQ(settings.choice("dispatch"), dispatch);
  }
}

TEST(Require, audits_timers_by_compute_where_the_setting_is) {
  const TempFolder folder;
  const OwnCache cache(folder / "cache");
  for (const std::string dispatch : {"fragment", "compute"}) {
    FaultyDevices devices;
    const SceneFile file =
        file_of(fmt::format(R"(, "setting": "relief?dispatch={}", "features": {{"shadow": [], "lod": [], "fade": [],
                            "normals": []}}, "measure": {{"samples": 1}})",
                            dispatch));
    static_cast<void>(run_require(file, {.backend = "null", .quiet = true, .open = devices.opener()}));
    EXPECT_EQ(devices.had_compute_audit(), dispatch == "compute");
  }
}

std::string refusal(const std::string& more) {
  try {
    static_cast<void>(file_of(more));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    return error.what();
  }
  return "no error";
}

TEST(SceneFile, refusals_name_the_line_and_the_key) {
  EXPECT_EQ(refusal(""), "no error");
  EXPECT_THAT(refusal(R"(, "lights": 1)"), HasSubstr("s.json:2: key 'lights'"));
  EXPECT_THAT(refusal(R"(, "features": {"shadow": "soft"})"), HasSubstr("'soft' is unknown"));
  EXPECT_THAT(refusal(R"(, "features": {"shade": []})"), HasSubstr("key 'features.shade'"));
  EXPECT_THAT(refusal(R"(, "setting": "flat")"), HasSubstr("displaces nothing"));
  EXPECT_THAT(refusal(R"(, "setting": "cone?shadow=cone")"), HasSubstr("shadow=cone"));
  EXPECT_THAT(refusal(R"(, "visible": "psnr>=40")"), HasSubstr("does not tell what is seen"));
  EXPECT_THAT(refusal(R"(, "visible": "e_xy.p99<=1")"), HasSubstr("does not tell what is seen"));
  EXPECT_THAT(refusal(R"(, "measure": {"samples": 0})"), HasSubstr("samples"));
}

TEST(SceneFile, a_camera_path_is_so_many_views) {
  const SceneFile file = parse_scene_file(R"({"scenes": {"heightmap": "rocks", "views": [
      "top", {"id": "walk", "from": "oblique", "to": {"id": "near", "elevation_deg": 50, "distance": 1}, "frames": 3}]}})",
                                          "s.json");
  ASSERT_EQ(file.scenes.size(), 4U);
  EXPECT_EQ(file.scenes[1].id, "rocks/walk_1");
  EXPECT_EQ(file.scenes[2].scene.view.elevation_deg, 40);
  EXPECT_EQ(file.scenes[3].scene.view.distance, 1);
}

/// A scene of configs/scenes in small frames, with the hard and the soft shadow and the quadric's silhouette alone.
SceneFile small_scene(const std::string& name) {
  SceneFile file = load_scene_file(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs/scenes" / (name + ".json"));
  for (const Feature& feature : all_features()) file.rows[std::string(feature.id)] = {};
  file.rows["shadow"] = {"cone", "soft_cone"};
  file.rows["silhouette"] = {"quadric"};
  for (SceneSpec& spec : file.scenes) spec.scene.width_px = spec.scene.height_px = 72;
  file.scenes.resize(std::min<std::size_t>(file.scenes.size(), 2));
  file.measure.samples = 3;
  return file;
}

class RequireOnDevice : public ::testing::TestWithParam<std::string_view> {};

// Each answer is what enumeration makes of the very values; the three are not the same.
TEST_P(RequireOnDevice, three_scenes_require_three_different_things) {
  if (find_backend(GetParam()).devices().empty()) GTEST_SKIP() << "no device";
  std::set<std::vector<std::string>> answers;
  for (const char* name : {"wall", "floor", "close"}) {
    const SceneFile file = small_scene(name);
    const RequireReport report =
        run_require(file, {.backend = std::string(GetParam()), .search = RequireSearch::greedy, .quiet = true});
    std::vector<TriedRow> tried;
    const SettingSpace made = setting_space(
        file, [](const Settings&) { return 0.0; }, tried);
    const RequireReport all =
        run_require(file, {.backend = std::string(GetParam()), .search = RequireSearch::exhaustive, .quiet = true});
    EXPECT_TRUE(report.is_met) << name;
    EXPECT_EQ(all.seen.size(), made.space.sets.size()) << name;
    FeatureSet least = all.seen.front().set;
    int size = 99;
    for (const SeenSet& seen : all.seen)
      if (seen.value <= file.visible.limit && size_of(seen.set) < size) {
        size = size_of(seen.set);
        least = seen.set;
      }
    EXPECT_EQ(size_of(report.answer), size) << name;
    EXPECT_EQ(all.ties.size() > 1 || all.answer == least, true) << name;
    for (const FeatureWorth& worth : report.worth) {
      EXPECT_NE(worth.with, worth.without);
      EXPECT_EQ(worth.price_ns.n, 3);
    }
    answers.insert(report.names(report.answer));
  }
  EXPECT_EQ(answers.size(), 3U);
}

INSTANTIATE_TEST_SUITE_P(Devices, RequireOnDevice, ::testing::Values("opengl"));

constexpr const char* kTestSceneFile = R"({"about": "a test",
  "scenes": {"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": ["top", "oblique"], "frame_px": [24, 24]},
  "features": {"shadow": ["linear", "soft_cone"], "fade": "footprint"}, "measure": {"samples": 3}})";

TEST(RequireCommand, answers_people_and_machines) {
  const TempFolder folder;
  std::ofstream(folder / "scene.json") << kTestSceneFile;
  const auto run = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"require", "scene.json", "--backend", "null", "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return run_reliefbench(words, folder.path());
  };
  const CommandResult found = run({"--visible", "flip<=0.9", "-o", "out", "--json"});
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const json answer = json::parse(found.out);
  EXPECT_EQ(schema_errors(answer, "require"), "");
  EXPECT_EQ(answer, json::parse(file_text(folder / "out/require.json")));
  EXPECT_EQ(answer["answer"]["features"], json::array());
  EXPECT_GT(std::filesystem::file_size(folder / "out/images/displacement-with.png"), 0U);
  const Image sheet = load_image(folder / "out/images/gallery.webp");
  const int rows = static_cast<int>(answer["features"].size());
  EXPECT_EQ(sheet.width, 3 * 24 + 2 * 4);
  EXPECT_EQ(sheet.height, rows * (24 + 4) - 4);
  EXPECT_THAT(file_text(folder / "out/require.html"), HasSubstr("data:image/webp;base64,"));

  const CommandResult text = run({"--visible", "flip<=0.9"});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_THAT(text.out, testing::StartsWith("scene requires nothing but plain normal mapping; nobody would miss"));
  EXPECT_THAT(text.out, HasSubstr("shadow=soft_cone"));

  std::string few_steps = kTestSceneFile;
  few_steps.insert(1, R"("setting": "relief?linear_steps=2", )");
  std::ofstream(folder / "scene.json") << few_steps;
  const CommandResult none = run({"--visible", "flip<=0"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.out, testing::StartsWith("No set of features draws scene unseen"));
}

TEST(RequireCommand, names_the_command_that_ships_what_it_judged) {
  const TempFolder folder;
  std::filesystem::create_directories(folder / "my maps");
  std::vector<std::uint8_t> texels(16 * 16 * 4);
  for (std::size_t i = 0; i < texels.size(); ++i) texels[i] = static_cast<std::uint8_t>(i * i % 251);
  write_png(folder / "my maps/rocks.png", 16, 16, texels);
  for (const std::string heightmap :
       {R"({"source": "my maps/rocks.png", "channel": "g", "invert": true, "normalise": true})",
        R"({"source": "fbm", "width": 16, "height": 24, "seed": 7})"}) {
    std::ofstream(folder / "scene.json") << R"({"scenes": {"heightmap": )" << heightmap << R"(, "views": "oblique",
        "frame_px": [16, 16], "relief_depth": 0.25, "base": 0.75, "wrap": "clamp"},
        "features": {"shadow": [], "lod": [], "fade": [], "normals": []}, "measure": {"samples": 1}})";
    const CommandResult judged =
        run_reliefbench({"require", "scene.json", "--backend", "null", "--quiet"}, folder.path());
    ASSERT_EQ(judged.exit_code, 0) << judged.err;
    const std::string command = judged.out.substr(judged.out.find("reliefbench export"));
    static_cast<void>(output_of(
        fmt::format("cd {} && {}{}", folder.path().string(), RELIEFBENCH_BINARY, command.substr(command.find(' ')))));
    ASSERT_TRUE(std::filesystem::exists(folder / "out/shipped/settings.json")) << judged.out;
    const json shipped = json::parse(file_text(folder / "out/shipped/settings.json"));
    EXPECT_EQ(shipped["wrap"], "clamp");
    EXPECT_EQ(shipped["relief_depth"], 0.25);
    EXPECT_EQ(shipped["base"], 0.75);
    const SceneFile file = load_scene_file(folder / "scene.json");
    EXPECT_EQ(shipped["heightmap"]["sha256"], Heightmaps().read(file.scenes.front().heightmap).sha256);
  }
}

TEST(RequireCommand, refuses_what_it_cannot_answer) {
  const TempFolder folder;
  std::ofstream(folder / "scene.json") << kTestSceneFile;
  const auto fails = [&](const std::vector<std::string>& words, int exit_code, const std::string& says) {
    const CommandResult result = run_reliefbench(words, folder.path());
    EXPECT_EQ(result.exit_code, exit_code) << says;
    EXPECT_THAT(result.err, HasSubstr(says));
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
  };
  fails({"require", "no.json"}, 2, "no.json");
  fails({"require", "scene.json", "--visible", "flip"}, 2, "is no bound");
  fails({"require", "scene.json", "--visible", "flicker<=1", "--backend", "null", "--quiet"}, 2, "flicker_frames");
  fails({"require", "scene.json", "--backend", "metal"}, 2, "metal");
}

TEST(SceneFiles, are_what_their_schema_says) {
  for (const auto& file :
       std::filesystem::directory_iterator(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs/scenes")) {
    EXPECT_EQ(schema_errors(json::parse(file_text(file.path()), nullptr, true, true), "scene"), "") << file.path();
    EXPECT_FALSE(load_scene_file(file.path()).about.empty());
  }
}

}  // namespace
}  // namespace reliefbench
