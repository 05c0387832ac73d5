// `export` and `view` take the whole scene from what was measured, and no other heightmap.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "kernels/base/atomic_file.h"
#include "reports/export/export.h"
#include "tests/command.h"
#include "tests/own_cache.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tests/test_heightmap.h"
#include "tests/written_run.h"
#include "tuner/decide/presets.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class SceneChoice : public ::testing::Test {
 protected:
  SceneChoice() {
    write_heightmap(folder_ / "rocks.pgm", 1);
    write_heightmap(folder_ / "other.pgm", 2);
    write_heightmap(folder_ / "elsewhere/renamed.pgm", 1);
    const json config = {
        {"scenes",
         {{{"heightmap",
            {{"source", (folder_ / "rocks.pgm").string()}, {"channel", "r"}, {"invert", true}, {"normalise", true}}},
           {"views", {{{"id", "mine"}, {"elevation_deg", 20}, {"distance", 1.1}, {"fov_deg", 40}}}},
           {"relief_depth", 0.25},
           {"tiling", 2},
           {"wrap", "clamp"},
           {"frame_px", {48, 32}}}}},
        {"measure", {{"samples", 3}, {"batch_ms", 0.1}, {"warmup_batches_max", 1}}},
        {"front", {{"error", "e_xy.p99"}, {"constraints", {"missed_rate<=0.5"}}}},
        {"budgets", {"e_xy.p99<=1000"}},
        {"sweeps", {{{"technique", "relief"}, {"axes", {{"linear_steps", {4, 16, 64}}}}}}}};
    run_ = swept(config, "run");
    config_ = config;
    write_atomically(folder_ / "presets.json", presets_json(make_presets({&run_, 1}, {})).dump(1));
  }
  [[nodiscard]] reliefbench::Run swept(const json& config, const std::string& name) const {
    const Config parsed = parse_config(config.dump(), folder_ / "config.json");
    return load_run(run_sweep(parsed, {.output = folder_ / name, .backends = {"null"}, .quiet = true}).folder);
  }
  [[nodiscard]] CommandResult command(std::vector<std::string> words) const {
    return run_reliefbench(words, folder_.path());
  }
  [[nodiscard]] CommandResult ship(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"export", "--presets", "presets.json", "--quality", "100", "-o", "out"});
    return command(arguments);
  }
  [[nodiscard]] CommandResult view(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "view");
    arguments.insert(arguments.end(), {"--backend", "null", "--png", "view.png"});
    return command(arguments);
  }
  void expect_refused(const CommandResult& result, const std::vector<std::string>& words) const {
    EXPECT_EQ(result.exit_code, 2) << result.out << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    for (const std::string& word : words) EXPECT_THAT(result.err, HasSubstr(word));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "view.png"));
  }
  [[nodiscard]] json settings() const { return json::parse(file_text(folder_ / "out/settings.json")); }
  [[nodiscard]] HeightmapSpec measured_heightmap() const { return run_.scenes.at(0).spec.heightmap; }
  /// Width and height of view.png.
  [[nodiscard]] std::pair<int, int> picture_size() const {
    const std::string png = file_text(folder_ / "view.png");
    const auto side = [&](std::size_t at) {
      return static_cast<unsigned char>(png.at(at + 2)) * 256 + static_cast<unsigned char>(png.at(at + 3));
    };
    return {side(16), side(20)};
  }

  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
  json config_;
  reliefbench::Run run_;
};

TEST_F(SceneChoice, a_preset_ships_what_was_measured) {
  for (const std::vector<std::string>& heightmap :
       {std::vector<std::string>{}, {"rocks"}, {"rocks.pgm"}, {"elsewhere/renamed.pgm"}}) {
    SCOPED_TRACE(heightmap.empty() ? "" : heightmap[0]);
    const CommandResult result = ship(heightmap);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, Not(HasSubstr("warning")));
    const json shipped = settings();
    EXPECT_EQ(schema_errors(shipped, "export"), "");
    EXPECT_EQ(shipped["wrap"], "clamp");
    EXPECT_EQ(shipped["relief_depth"], 0.25);
    EXPECT_EQ(shipped["heightmap"]["invert"], true);
    EXPECT_EQ(shipped["heightmap"]["sha256"], run_.scenes[0].heights_sha256);
    EXPECT_EQ(shipped["scene"]["key"], run_.scenes[0].key.hex);
    EXPECT_EQ(shipped["evidence"]["same_scene"], true);
    EXPECT_EQ(shipped["evidence"]["scenes"][0]["scene_key"], run_.scenes[0].key.hex);
    EXPECT_THAT(file_text(folder_ / "out/relief.glsl"),
                AllOf(HasSubstr("wrap clamp"), HasSubstr("measured with 0.25")));
    const std::string setting = shipped["setting"];
    const Export by_hand = make_export({.heightmap = measured_heightmap(),
                                        .settings = parse_setting(setting),
                                        .wrap = Wrap::clamp,
                                        .relief_depth = 0.25});
    EXPECT_EQ(file_text(folder_ / "out/relief.ktx2"), by_hand.files.at(0).bytes);
  }
}

TEST_F(SceneChoice, a_case_of_a_run_ships_with_its_own_evidence) {
  const Record& record = run_.records.at(1);
  const CommandResult result = command({"export", "--run", "run", "--case", record.case_id, "-o", "out"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json shipped = settings();
  EXPECT_EQ(schema_errors(shipped, "export"), "");
  EXPECT_EQ(shipped["relief_depth"], 0.25);
  EXPECT_EQ(shipped["evidence"]["run"], "run");
  EXPECT_EQ(shipped["evidence"]["scenes"][0]["case"], record.case_id);
  EXPECT_EQ(shipped["evidence"]["scenes"][0]["error"], record.error->at("e_xy.p99"));
  std::filesystem::remove_all(folder_ / "out");
  expect_refused(command({"export", "--run", "run", "--case", "relief@rocks/mine?linear_steps=5", "-o", "out"}),
                 {"--run run: has no case 'relief@rocks/mine?linear_steps=5'"});
}

TEST_F(SceneChoice, a_finer_sampler_than_what_ships_allows_for_is_said) {
  config_["sweeps"] = {{{"technique", "cone"}, {"axes", {{"format", "rg8"}, {"filter", "hardware"}}}}};
  reliefbench::Run run = swept(config_, "cones");
  const auto told = [&](double worst) {
    run.info["devices"][0]["filter"] = {{{"texels", "unorm8"}, {"least", -worst}, {"greatest", worst}}};
    write_run(run);
    const CommandResult result =
        command({"export", "--run", "cones", "--case", run.records.at(0).case_id, "-o", "out"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(schema_errors(settings(), "export"), "");
    EXPECT_NEAR(settings()["evidence"]["sampler_shift"].get<double>(), worst, 1e-4);
    return result.err;
  };
  EXPECT_THAT(told(0.001), HasSubstr("what ships allows for 1/256 and so steps shorter"));
  EXPECT_THAT(told(0.004), Not(HasSubstr("steps shorter")));
}

TEST_F(SceneChoice, another_heightmap_is_refused_unless_it_is_told) {
  const std::string before = short_key(run_.scenes[0].heights_sha256);
  HeightmapSpec spec = measured_heightmap();
  spec.source = folder_ / "other.pgm";
  const std::string now = short_key(Heightmaps().read(spec).sha256);
  expect_refused(ship({"other.pgm"}),
                 {"other.pgm holds the heights " + now, "rocks (" + before + ")", "--other-heightmap"});
  expect_refused(view({"other.pgm", "--presets", "presets.json", "--quality", "0"}), {"--other-heightmap"});
  expect_refused(ship({"missing.pgm"}), {"missing.pgm"});

  const CommandResult told = ship({"other.pgm", "--other-heightmap"});
  ASSERT_EQ(told.exit_code, 0) << told.err;
  EXPECT_THAT(told.err, HasSubstr("warning: the setting was measured on another heightmap"));
  const json shipped = settings();
  EXPECT_EQ(schema_errors(shipped, "export"), "");
  EXPECT_EQ(shipped["evidence"]["same_scene"], false);
  EXPECT_EQ(shipped["heightmap"]["invert"], false);
  EXPECT_EQ(shipped["relief_depth"], 0.25);
  EXPECT_EQ(shipped["wrap"], "clamp");
}

TEST_F(SceneChoice, a_heightmap_that_changed_since_is_another) {
  write_heightmap(folder_ / "rocks.pgm", 3);
  expect_refused(ship({}), {"rocks.pgm holds the heights ", short_key(run_.scenes[0].heights_sha256)});
  expect_refused(ship({"rocks"}), {"rocks holds the heights "});
}

TEST_F(SceneChoice, what_is_told_besides_goes_before_and_is_said) {
  const CommandResult result = ship({"--relief-depth", "0.1"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("warning: the setting was measured at relief depth 0.25"));
  EXPECT_EQ(settings()["relief_depth"], 0.1);
  EXPECT_EQ(settings()["evidence"]["same_scene"], false);
  EXPECT_NE(settings()["scene"]["key"], run_.scenes[0].key.hex);
}

TEST_F(SceneChoice, another_base_ships_and_is_said) {
  const CommandResult result = ship({"--base", "0.25"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("warning: the setting was measured at base 1"));
  EXPECT_EQ(schema_errors(settings(), "export"), "");
  EXPECT_EQ(settings()["base"], 0.25);
  EXPECT_EQ(settings()["scene"]["base"], 0.25);
}

TEST_F(SceneChoice, a_relief_round_the_camera_ships_but_is_not_viewed) {
  expect_refused(view({"--run", "run", "--case", run_.records[0].case_id, "--base", "0", "--relief-depth", "9"}),
                 {"the camera is inside the relief", "a relief 9 deep of base 0 reaches 4.5"});
  EXPECT_EQ(ship({"--base", "0", "--relief-depth", "9"}).exit_code, 0);
  EXPECT_EQ(settings()["base"], 0);
}

TEST_F(SceneChoice, view_draws_the_measured_scene) {
  for (const Record& record : run_.records) {
    const CommandResult result = view({"--run", "run", "--case", record.case_id});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(picture_size(), (std::pair{48, 32}));
    EXPECT_THAT(result.out, HasSubstr(fmt::format("e_xy.p99 {:.4g}", record.error->at("e_xy.p99"))));
  }
  ASSERT_EQ(view({"--presets", "presets.json", "--quality", "0"}).exit_code, 0);
  EXPECT_EQ(picture_size(), (std::pair{48, 32}));
}

TEST_F(SceneChoice, view_of_a_case_draws_the_scene_of_its_id) {
  const auto drawn = [&](const std::vector<std::string>& arguments) {
    const CommandResult result = view(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  const std::string grazing = drawn({"--case", "relief@fbm_32x32/grazing?linear_steps=9"});
  EXPECT_EQ(grazing, drawn({"fbm", "--size", "32x32", "--case", "relief?linear_steps=9", "--view", "grazing"}));
  EXPECT_NE(grazing, drawn({"fbm", "--size", "32x32", "--case", "relief?linear_steps=9"}));
  std::filesystem::remove(folder_ / "view.png");
  expect_refused(view({"hills", "--case", "relief@rocks/grazing?linear_steps=9"}),
                 {"HEIGHTMAP is hills, but the case is of rocks; --other-heightmap takes it all the same"});
  expect_refused(view({"--case", "relief@nowhere/top?linear_steps=9"}), {"'nowhere' is no known name"});
  expect_refused(view({"rocks.pgm", "--case", "relief@rocks/mine?linear_steps=9"}),
                 {"view 'mine' is a config's own: say --run RUN, or --view"});
  expect_refused(view({"--case", "relief?linear_steps=9"}), {"view needs a HEIGHTMAP"});
}

}  // namespace
}  // namespace reliefbench
