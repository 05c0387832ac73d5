// What `--features` asks for, by the names that `require` answers with.
#include "tuner/plan/wanted_features.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "kernels/base/error.h"
#include "tests/cli_rig.h"
#include "tests/finished_run.h"
#include "tuner/plan/plan.h"
#include "tuner/plan/setting_space.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

bool is_shown(const std::string& setting, const std::string& features) {
  return shows(parse_setting(setting), parse_wanted_features(features));
}

TEST(WantedFeatures, are_shown_by_their_rows) {
  EXPECT_FALSE(is_shown("cone", "shadow"));
  EXPECT_TRUE(is_shown("cone?shadow=cone", "shadow"));
  EXPECT_TRUE(is_shown("cone?shadow=cone", "shadow=cone"));
  EXPECT_FALSE(is_shown("cone?shadow=cone", "shadow=linear"));
  EXPECT_FALSE(is_shown("cone?shadow=cone", "penumbra"));
  EXPECT_TRUE(is_shown("cone?shadow=soft_cone", "shadow,penumbra"));
  EXPECT_TRUE(is_shown("cone?shadow=soft_taps&lod=footprint", "lod,penumbra"));
  EXPECT_FALSE(is_shown("cone?shadow=soft_taps", "lod,penumbra"));
  EXPECT_FALSE(is_shown("flat", "shadow"));
  EXPECT_FALSE(is_shown("flat?normals=footprint", "displacement"));
  EXPECT_TRUE(is_shown("parallax", "displacement"));
}

std::string refusal(const std::string& features) {
  try {
    (void)parse_wanted_features(features);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(WantedFeatures, that_nothing_shows_are_refused) {
  EXPECT_THAT(refusal("shadows"), AllOf(HasSubstr("--features: 'shadows'"), HasSubstr("did you mean 'shadow'")));
  EXPECT_THAT(refusal("shadow=hard"), AllOf(HasSubstr("shadow 'hard'"), HasSubstr("soft_cone")));
  EXPECT_THAT(refusal("shadow=none"), HasSubstr("shadow 'none'"));  // the plainest row shows nothing
  EXPECT_THAT(refusal("refinement"), HasSubstr("unknown"));         // no feature of the scene
  EXPECT_THAT(refusal(""), HasSubstr("unknown"));
  EXPECT_EQ(refusal("shadow=cone,penumbra"), "--features shadow=cone,penumbra: no row of shadow is all of that");
}

std::set<std::string> settings_of(const Config& config) {
  std::set<std::string> ids;
  for (const Case& one : make_plan(config, std::vector<std::string>{"vulkan"}, "").cases)
    ids.insert(setting_id(one.settings));
  return ids;
}

// Nothing in it is refused, and nothing but the plainest search fills a solid's holes.
TEST(BuiltInSpace, of_a_solid_traces_solids) {
  const Config space = default_tune_config({.source = "ball", .width = 16, .height = 16}, {});
  ASSERT_EQ(space.scenes.size(), 1U);
  EXPECT_EQ(space.scenes.front().id, "ball_16x16/oblique");
  std::set<std::string> techniques_tried;
  for (const std::string& id : settings_of(space)) {
    EXPECT_EQ(heights_conflict(parse_setting(id), true), "");
    techniques_tried.emplace(parse_setting(id).technique().id);
  }
  EXPECT_THAT(techniques_tried, ElementsAre("double_cone", "double_mip", "double_relief", "relief"));
}

TEST(WantedFeatures, make_a_space_of_all_that_show_them) {
  const Config space = default_tune_config({.source = "rocks"}, {});
  const Config with = with_features(space, "shadow,penumbra");
  EXPECT_NE(with.text, space.text);
  const std::set<std::string> ids = settings_of(with);
  EXPECT_THAT(ids, Each(AnyOf(HasSubstr("shadow=soft_taps"), HasSubstr("shadow=soft_cone"))));
  // Every setting that displaces has the one that needs no cones; with cones there is the other, too.
  std::set<std::string> taps;
  std::size_t displacing = 0;
  for (const std::string& id : settings_of(space)) displacing += parse_setting(id).technique().reads_map() ? 1 : 0;
  for (const std::string& id : ids)
    if (parse_setting(id).is("shadow", "soft_taps")) taps.insert(id);
  EXPECT_EQ(taps.size(), displacing);
  EXPECT_GT(ids.size(), taps.size());
  EXPECT_LT(ids.size(), 2 * taps.size());
}

TEST(WantedFeatures, that_a_config_sweeps_itself_are_held_to_it) {
  const Config config = parse_config(R"({
    "scenes": [{"heightmap": "rocks", "views": ["oblique"]}],
    "sweeps": [{"technique": "cone", "axes": {"shadow": ["none", "cone", "soft_cone"]}},
               {"technique": "quad_cone"}, {"technique": "flat"}]})",
                                     "two.json");
  // Four cones a texel are not one, and flat has no hits.
  EXPECT_EQ(settings_of(with_features(config, "shadow=cone")), std::set{setting_id(parse_setting("cone?shadow=cone"))});
  const Config linked = parse_config(R"({
    "scenes": [{"heightmap": "rocks", "views": ["oblique"]}],
    "sweeps": [{"technique": "cone", "axes": {"shadow,cone_steps": [["none", 8], ["cone", 16]]}}]})",
                                     "linked.json");
  EXPECT_THROW((void)with_features(linked, "shadow"), Error);
  const Config flat = parse_config(R"({"scenes": [{"heightmap": "rocks", "views": ["oblique"]}],
    "sweeps": [{"technique": "flat"}]})",
                                   "flat.json");
  EXPECT_THROW((void)with_features(flat, "displacement"), Error);
}

TEST_F(CliTest, features_narrow_recommend_and_presets_and_widen_tune) {
  static_cast<void>(null_sweep(folder_));
  const CommandResult all = run({"recommend", "run", "--max-error", "e_xy.p95<=100", "--json"});
  ASSERT_EQ(all.exit_code, 0) << all.err;
  EXPECT_THAT(all.out, HasSubstr("\"technique\": \"flat\""));
  const CommandResult displaced =
      run({"recommend", "run", "--max-error", "e_xy.p95<=100", "--features", "displacement", "--json"});
  EXPECT_EQ(displaced.exit_code, 0) << displaced.err;
  EXPECT_EQ(displaced.out.find("\"technique\": \"flat\""), std::string::npos);
  const CommandResult none = run({"recommend", "run", "--features", "shadow"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("--features shadow: no setting in run shows that"));
  EXPECT_EQ(run({"presets", "run", "-o", "p.json", "--features", "shadow"}).exit_code, 2);
  EXPECT_EQ(run({"presets", "run", "-o", "p.json", "--features", "displacement"}).exit_code, 0);
  EXPECT_EQ(file_text(folder_ / "p.json").find("\"flat\""), std::string::npos);
  EXPECT_EQ(run({"tune", "--replay", "run", "--features", "displacement"}).exit_code, 2);
  const CommandResult tuned = run({"tune", "config.json", "--backend", "null", "--features", "displacement",
                                   "--max-error", "e_xy.p95<=100", "-o", "t", "--quiet", "--json"});
  EXPECT_EQ(tuned.exit_code, 0) << tuned.err;
  EXPECT_EQ(nlohmann::json::parse(tuned.out).at("settings").size(), 60);
}

// Features change the config's text, which has all of its scenes.
TEST_F(CliTest, tune_keeps_to_the_scene_that_is_chosen_where_features_are_wanted) {
  write("two.json", R"({
    "scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "frame_px": [16, 16],
                "views": ["top", "oblique"]}],
    "sweeps": [{"technique": "relief", "axes": {"linear_steps": [4, 8, 16]}}, {"technique": "flat"}]})");
  const CommandResult tuned = run({"tune", "two.json", "--backend", "null", "--scene", "oblique", "--features",
                                   "displacement", "--max-error", "e_xy.p95<=100", "-o", "t", "--quiet"});
  EXPECT_EQ(tuned.exit_code, 0) << tuned.err;
  const nlohmann::json scenes = nlohmann::json::parse(file_text(folder_ / "t/run.json")).at("scenes");
  ASSERT_EQ(scenes.size(), 1) << scenes;
  EXPECT_EQ(scenes.front().at("id"), "fbm_16x16/oblique");
}

// The way from what a scene requires to what it ships: one file, one set of names.
TEST_F(CliTest, tune_takes_a_scene_file) {
  std::ofstream(folder_ / "scene.json") << R"({
    "about": "a wall", "visible": "flip<=0.9",
    "scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "frame_px": [32, 32], "views": ["oblique"]}]})";
  const CommandResult tuned =
      run({"tune", "scene.json", "--backend", "null", "--time-limit", "2", "-o", "t", "--quiet", "--json"});
  const nlohmann::json json = nlohmann::json::parse(tuned.out);
  EXPECT_EQ(json.at("question").at("max_error"), nlohmann::json({"flip<=0.9"})) << tuned.err;
  const CommandResult wrong = run({"tune", "t/run.json", "--backend", "null"});
  EXPECT_EQ(wrong.exit_code, 2);
}

}  // namespace
}  // namespace reliefbench
