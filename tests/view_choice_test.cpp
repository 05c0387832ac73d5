// What the viewer's panel and scripts do, without a window.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "kernels/base/error.h"
#include "reports/viewer/background.h"
#include "reports/viewer/copied_text.h"
#include "reports/viewer/overlay.h"
#include "reports/viewer/pane.h"
#include "reports/viewer/script_run.h"
#include "tests/schema.h"
#include "tuner/plan/config.h"
#include "tuner/plan/plan.h"
#include "tuner/plan/preset_file.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

ViewChoice choice_of(std::string_view setting = "relaxed_cone") {
  return {.settings = parse_setting(setting),
          .spec = {.id = "fbm_64x64/oblique",
                   .heightmap = {.source = "fbm", .width = 64, .height = 64},
                   .scene = {.view = view_presets()[1], .width_px = 40, .height_px = 30}}};
}

ViewPicks some_picks() {
  return {.levels = {{.settings = parse_setting("flat"), .label = "quality 0", .quality = 0},
                     {.settings = parse_setting("cone"), .label = "quality 100", .quality = 100}},
          .points = {{.settings = parse_setting("relief"), .label = "relief", .time_ns = 1e6, .error = 0.5}},
          .error_metric = "e_xy.p99"};
}

ViewChoice with(std::string_view name, std::string_view value, ViewChoice choice = choice_of()) {
  set(choice, some_picks(), name, value);
  return choice;
}

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    return error.what();
  }
  return "";
}

TEST(ViewChoiceTest, every_active_parameter_of_every_technique_is_a_control) {
  for (const Technique& technique : techniques()) {
    const ViewChoice choice = with("technique", technique.id);
    EXPECT_EQ(&choice.settings.technique(), &technique);
    for (const SettingValue& given : choice.settings.values()) {
      const int other =
          given.value == given.param.max || !given.param.choices.empty() ? given.param.min : given.param.max;
      EXPECT_EQ(with(given.param.id, given.param.text(other), choice).settings.get(given.param.id), other);
    }
  }
}

TEST(ViewChoiceTest, a_technique_takes_over_what_it_has_in_common) {
  const ViewChoice cone =
      with("technique", "cone", choice_of("relaxed_cone?cone_steps=9&shadow=linear&shadow_steps=7"));
  EXPECT_EQ(cone.settings.get("cone_steps"), 9);
  EXPECT_EQ(cone.settings.get("shadow_steps"), 7);
  EXPECT_EQ(with("steps", "11", cone).settings.get("cone_steps"), 11);  // the first count of steps
}

TEST(ViewChoiceTest, knobs_and_names_are_set_within_their_bounds) {
  for (const Knob& knob : knobs()) {
    ViewChoice choice = with(knob.id, fmt::format("{}", knob.high));
    EXPECT_EQ(knob.in(choice.spec.scene), knob.high) << knob.id;
    EXPECT_THAT(refusal([&] { with(knob.id, fmt::format("{}", knob.high + 1)); }), HasSubstr("not a number from"));
  }
  EXPECT_EQ(with("overlay", "taps").overlay, Overlay::taps);
  EXPECT_EQ(with("split", ".25").split, 0.25);
  EXPECT_TRUE(with("help", "on").shows_help);
  EXPECT_FALSE(with("close", "error").is_open(Section::error));
  EXPECT_EQ(with("view", "top").spec.scene.view, view_presets()[0]);
  EXPECT_EQ(with("level", "100").settings, parse_setting("cone"));
  EXPECT_EQ(with("point", "1").settings, parse_setting("relief"));
  EXPECT_EQ(with("other", "setting").other, choice_of().settings);
  EXPECT_FALSE(with("other", "reference", with("other", "cone?cone_steps=3")).other);
}

TEST(ViewChoiceTest, what_there_is_not_is_named) {
  const auto of = [](std::string_view name, std::string_view value) { return refusal([&] { with(name, value); }); };
  EXPECT_THAT(of("techniqe", "cone"), HasSubstr("did you mean 'technique'?"));
  EXPECT_THAT(of("technique", "cones"), HasSubstr("cones"));
  EXPECT_THAT(of("shadow_steps", "4"), HasSubstr("means nothing with relaxed_cone"));
  EXPECT_THAT(of("overlay", "heat"), HasSubstr("known: none, error, missed, taps"));
  EXPECT_THAT(of("split", "nan"), HasSubstr("from 0 to 1"));
  EXPECT_THAT(of("blink", "yes"), HasSubstr("neither on nor off"));
  EXPECT_THAT(of("level", "50"), HasSubstr("the presets have 0, 100"));
  EXPECT_THAT(of("point", "2"), HasSubstr("from 1 to 1"));
  EXPECT_THAT(refusal([] {
                ViewChoice choice = choice_of();
                set(choice, {}, "point", "1");
              }),
              HasSubstr("there is no run"));
}

TEST(ViewChoiceTest, the_camera_stays_above_the_plane_and_within_bounds) {
  Scene scene = choice_of().spec.scene;
  orbit(scene, 1000, 1000);
  EXPECT_EQ(scene.view.elevation_deg, 90);
  EXPECT_LE(std::abs(scene.view.azimuth_deg), 180);
  orbit(scene, 0, -1000);
  EXPECT_GT(scene.view.elevation_deg, 0);
  const double before = scene.view.distance;
  zoom(scene, 1);
  EXPECT_LT(scene.view.distance, before);
  zoom(scene, -1e6);
  EXPECT_TRUE(std::isfinite(scene.view.distance));
  pan(scene, 1e9);
  EXPECT_LE(scene.pan, 8);
}

TEST(ViewScriptTest, lines_are_tried_before_anything_is_opened) {
  const auto parse = [](const std::string& text) { return parse_script(text, "tour.txt", choice_of(), some_picks()); };
  const auto lines = parse("# a comment\n\nset steps 4   # words\nsplit .3\norbit -30 1e1\nscreenshot a\nquit\n");
  ASSERT_EQ(lines.size(), 5U);
  EXPECT_EQ(lines[0].place, "tour.txt:3");
  EXPECT_EQ(lines[1].words, (std::vector<std::string>{"split", ".3"}));
  EXPECT_EQ(lines[2].numbers, (std::vector{-30.0, 10.0}));
  const auto expect_refused = [&](const std::string& text, const std::string& words) {
    EXPECT_THAT(refusal([&] { static_cast<void>(parse(text)); }), HasSubstr(words)) << text;
  };
  expect_refused("wait\nwiat\n", "tour.txt:2: 'wiat' is unknown (did you mean 'wait'?");
  expect_refused("orbit 3\n", "tour.txt:1: ");
  expect_refused("orbit 3 x\n", "tour.txt:1: 'x' is no number");
  expect_refused("orbit inf 0\n", "tour.txt:1: ");
  expect_refused("frames 0\n", "tour.txt:1: 0 is not a number of frames");
  expect_refused("copy preset\n", "tour.txt:1: expected 'copy case|config|preset FILE'");
  expect_refused("copy presets a\n", "tour.txt:1: 'presets' is unknown (did you mean 'preset'?");
  expect_refused("set technique cone\nset format r8\nwait\n", "tour.txt:3: format r8 has room for 0 cone ratios");
  for (const VerbRow& row : verbs()) EXPECT_FALSE(row.description.empty());
}

TEST(ViewScriptTest, a_run_waits_until_everything_is_there) {
  ViewChoice choice = choice_of();
  ScriptRun run(parse_script("set steps 4\nscreenshot a\nframes 2\nquit\n", "tour.txt", choice, {}));
  for (int i = 0; i < 5; ++i) EXPECT_EQ(run.step(choice, {}, false).screenshot, "");
  EXPECT_EQ(choice.settings.get("cone_steps"), 4);
  std::string shot;
  for (int i = 0; i < 9 && shot.empty(); ++i) shot = run.step(choice, {}, true).screenshot;
  EXPECT_EQ(shot, "a.png");
  ::testing::internal::CaptureStdout();
  int frames = 0;
  while (!run.step(choice, {}, false).quit) ++frames;
  EXPECT_EQ(frames, 3);  // two, and the one in which it was asked for
  EXPECT_THAT(::testing::internal::GetCapturedStdout(), HasSubstr("2 frames at rest: "));
  EXPECT_TRUE(run.is_over());
}

TEST(ViewKeysTest, a_map_is_shared_by_what_it_does_not_depend_on) {
  const SceneSpec spec = choice_of().spec;
  const auto key = [&](std::string_view setting) { return map_key(parse_setting(setting), spec); };
  EXPECT_EQ(key("cone?cone_steps=4"), key("cone?cone_steps=5&shadow=linear"));
  EXPECT_NE(key("cone?format=rg8"), key("cone?format=rg16"));
  EXPECT_NE(key("cone"), key("relief"));
  SceneSpec deeper = spec;
  deeper.scene.relief_depth = 0.3;
  EXPECT_NE(map_key(parse_setting("cone"), deeper), key("cone"));
  for (const Knob& knob : knobs()) {  // each of them is seen
    SceneSpec changed = spec;
    knob.in(changed.scene) = 0.9 * knob.high;
    EXPECT_NE(picture_key(parse_setting("cone"), changed), picture_key(parse_setting("cone"), spec)) << knob.id;
  }
}

TEST(CopiedTextTest, a_config_is_of_just_that_case) {
  ViewChoice choice = choice_of("cone?cone_steps=12&shadow=linear");
  orbit(choice.spec.scene, 12, 3);
  pan(choice.spec.scene, 0.25);
  choice.spec.scene.light.elevation_deg = 20;
  const CopiedView view{.choice = &choice, .backend = "null"};
  const Config config = parse_config(copied_text("config", view), "copied.json");
  const Plan plan = make_plan(config, std::vector<std::string>{"null"}, "");
  ASSERT_EQ(plan.cases.size(), 1U);
  EXPECT_EQ(plan.cases[0].settings, choice.settings);
  EXPECT_EQ(plan.cases[0].id() + "\n", copied_text("case", view));
  EXPECT_EQ(scene_key("", config.scenes.at(0).scene), scene_key("", choice.spec.scene));
  EXPECT_EQ(schema_errors(nlohmann::json::parse(copied_text("config", view)), "config"), "");
}

TEST(CopiedTextTest, a_preset_is_read_back) {
  const ViewChoice choice = choice_of("cone?cone_steps=12");
  const std::string hash(64, 'a');
  CopiedView view{.choice = &choice,
                  .heights_sha256 = hash,
                  .backend = "vulkan",
                  .device = "a card",
                  .driver = "its driver",
                  .times_ns = {3e6, 1e6, 2e6},
                  .error = 0.25};
  const std::vector<LoadedPreset> levels = parse_presets(copied_text("preset", view), "copied.json");
  ASSERT_EQ(levels.size(), 1U);
  EXPECT_EQ(levels[0].settings, choice.settings);
  EXPECT_EQ(levels[0].device, "a card");
  EXPECT_EQ(levels[0].evidence["scenes"][0]["time_ns"], 2e6);
  EXPECT_EQ(levels[0].scenes.at(0).key, scene_key(hash, choice.spec.scene));
  EXPECT_EQ(schema_errors(nlohmann::json::parse(copied_text("preset", view)), "presets"), "");
  view.times_ns.clear();
  EXPECT_THAT(refusal([&] { static_cast<void>(copied_text("preset", view)); }), HasSubstr("frame times"));
}

TEST(OverlayTest, pictures_have_the_colours_of_their_legend) {
  const std::vector<PixelScore> scores = {{.e_xy = 0, .e_z = 0, .verdict = Verdict::good},
                                          {.e_xy = 100, .e_z = 0, .verdict = Verdict::missed},
                                          {.e_xy = 1, .e_z = 0, .verdict = Verdict::unconverged},
                                          {.e_xy = 0, .e_z = 0, .verdict = Verdict::no_ray}};
  const std::vector<float> taps = {1, 1024, 32, -1};
  const OverlayPixels pixels{.scores = scores, .taps = taps, .width_px = 2, .height_px = 2};
  const auto pixel = [](const std::vector<std::uint8_t>& picture, std::size_t i) {
    return Rgb{picture.at(4 * i), picture.at(4 * i + 1), picture.at(4 * i + 2)};
  };
  const auto error = overlay_picture(Overlay::error, pixels);
  EXPECT_EQ(pixel(error, 0), overlay_legend(Overlay::error).ramp.front().color);
  EXPECT_EQ(pixel(error, 1), overlay_legend(Overlay::error).marks[0].color);
  const auto missed = overlay_picture(Overlay::missed, pixels);
  EXPECT_EQ((std::array{missed[3], missed[7], missed[11], missed[15]}), (std::array<std::uint8_t, 4>{0, 255, 255, 0}));
  EXPECT_EQ(pixel(missed, 2), overlay_legend(Overlay::missed).marks[1].color);
  const auto counted = overlay_picture(Overlay::taps, pixels);
  const OverlayLegend legend = overlay_legend(Overlay::taps);
  EXPECT_EQ(legend.ramp.front().text, "1");
  EXPECT_EQ(legend.ramp.back().text, "1024");
  EXPECT_EQ(pixel(counted, 0), legend.ramp.front().color);
  EXPECT_EQ(pixel(counted, 1), legend.ramp.back().color);
  EXPECT_EQ(pixel(counted, 2), legend.ramp.at(5).color);  // 2^5
  EXPECT_EQ(pixel(counted, 3), legend.marks.at(0).color);
  EXPECT_TRUE(overlay_legend(Overlay::none).title.empty());
}

TEST(BackgroundTest, results_and_failures_come_in_the_callers_thread) {
  Background background;
  const auto wait = [&] {
    for (int i = 0; i < 10000 && background.is_busy(); ++i) {
      background.finish();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  const std::thread::id here = std::this_thread::get_id();
  std::thread::id worked;
  std::thread::id finished;
  background.start([&]() -> Background::Finish {
    worked = std::this_thread::get_id();
    return [&] { finished = std::this_thread::get_id(); };
  });
  wait();
  EXPECT_NE(worked, here);
  EXPECT_EQ(finished, here);
  background.start([]() -> Background::Finish { fail_input("no such map"); });
  EXPECT_THAT(refusal(wait), HasSubstr("no such map"));
  EXPECT_FALSE(background.is_busy());
}

}  // namespace
}  // namespace reliefbench
