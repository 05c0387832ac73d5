// `view --png`: draws what a sweep draws.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kernels/base/atomic_file.h"
#include "kernels/image/image.h"
#include "tests/backend_rig.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tests/scoped_variable.h"
#include "tuner/decide/presets.h"
#include "tuner/measure/prepare.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::Each;
using ::testing::FloatNear;
using ::testing::HasSubstr;
using ::testing::Pointwise;

const View kHome = view_presets()[1];  // oblique

TEST(ViewTest, the_azimuth_turns_the_camera_about_the_look_at_point) {
  Scene scene{.view = kHome};
  const FrameUniforms ahead = frame_uniforms(scene, 8, 8);
  EXPECT_EQ(ahead.position[0], 0.5F);
  EXPECT_THAT((std::array{ahead.right[1], ahead.up[0], ahead.forward[0]}), Each(0.0F));
  scene.view.azimuth_deg = 90;  // the camera is east of the centre and looks west
  const FrameUniforms turned = frame_uniforms(scene, 8, 8);
  const auto quarter = [](const std::array<float, 4>& v) { return std::array{-v[1], v[0], v[2], v[3]}; };
  EXPECT_THAT(turned.right, Pointwise(FloatNear(1e-6F), quarter(ahead.right)));
  EXPECT_THAT(turned.up, Pointwise(FloatNear(1e-6F), quarter(ahead.up)));
  EXPECT_THAT(turned.forward, Pointwise(FloatNear(1e-6F), quarter(ahead.forward)));
  EXPECT_NEAR(turned.position[0], 0.5 + (0.5 - ahead.position[1]), 1e-6);
  EXPECT_NEAR(turned.position[1], 0.5, 1e-6);
  EXPECT_EQ(turned.position[2], ahead.position[2]);
  EXPECT_EQ(turned.light, ahead.light);
}

/// `view fbm`, small.
std::vector<std::string> view_of(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"view", "--size", "32x32", "--size-px", "48,32", "fbm"});
  return arguments;
}

class ViewOnDevice : public BackendTest {
 protected:
  TempFolder folder_;
};

TEST_P(ViewOnDevice, the_picture_is_the_sweeps_own) {
  const Cache cache(folder_ / "cache");
  WallSplit split;
  Session session(row(), 0, split, {.audits = Audits::none});
  MapLibrary library(cache, split);
  Preparer preparer(
      {.session = session, .library = library, .cache = cache, .split = split, .timeout_s = 60, .flicker_frames = 0});
  const SceneSpec spec{
      .id = "fbm_32x32/grazing",
      .heightmap = {.source = "fbm", .width = 32, .height = 32},
      .scene = {.view = view_presets()[2], .relief_depth = 0.2, .tiling = 2, .width_px = 48, .height_px = 32}};
  for (const std::string id : {"flat", "relief?linear_steps=9", "relief?linear_steps=5&dither=temporal",
                               "cone?format=rgba8", "safety_shape"}) {
    const Case c{.settings = parse_setting(id), .scene_id = spec.id, .backend = std::string(row().id)};
    write_png(folder_ / "sweep.png", spec.scene.width_px, spec.scene.height_px, preparer.pictures(c, spec).frame);
    const CommandResult result =
        run_reliefbench(view_of({"--case", c.id(), "--backend", c.backend, "--view", "grazing", "--relief-depth", "0.2",
                                 "--tiling", "2", "--png", "view.png"}),
                        folder_.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(file_text(folder_ / "view.png") == file_text(folder_ / "sweep.png")) << id;
    EXPECT_THAT(result.out, HasSubstr(named(c.settings) + ": e_xy.p99 "));
  }
}

INSTANTIATE_TEST_SUITE_P(Devices, ViewOnDevice, ::testing::Values("opengl", "vulkan"), backend_name);

class ViewCommandTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::vector<reliefbench::Run> runs = {load_run(null_sweep(folder_))};
    presets_ = presets_json(make_presets(runs, {}));
    write_atomically(folder_ / "presets.json", presets_.dump(1));
  }
  [[nodiscard]] CommandResult view(const std::vector<std::string>& arguments) const {
    return run_reliefbench(view_of(arguments), folder_.path());
  }
  void expect_refused(const std::vector<std::string>& arguments, int exit_code, const std::string& words) const {
    const CommandResult result = view(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "view.png"));
  }
  const ScopedVariable no_x_{"DISPLAY", std::nullopt};
  const ScopedVariable no_wayland_{"WAYLAND_DISPLAY", std::nullopt};
  TempFolder folder_;
  nlohmann::json presets_;
};

TEST_F(ViewCommandTest, draws_a_level_of_the_presets) {
  const std::vector<LoadedPreset> levels = parse_presets(file_text(folder_ / "presets.json"), "presets.json");
  for (const std::size_t i : {std::size_t{0}, levels.size() - 1}) {
    const CommandResult result =
        view({"--presets", "presets.json", "--quality", std::to_string(levels.at(i).quality), "--png", "view.png"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(result.out.starts_with(named(levels.at(i).settings) + ": ")) << result.out;
    EXPECT_TRUE(file_text(folder_ / "view.png").starts_with("\x89PNG"));
  }
}

TEST_F(ViewCommandTest, bad_input_is_refused_in_one_line) {
  const auto with_png = [&](std::vector<std::string> arguments, const std::string& words, int exit_code = 2) {
    arguments.insert(arguments.end(), {"--png", "view.png"});
    expect_refused(arguments, exit_code, words);
  };
  with_png({}, "view needs --presets with --quality, --case, or --tune");
  with_png({"--presets", "presets.json", "--quality", "101"}, "presets.json: there is no level 101; it has 0, ");
  with_png({"--presets", "presets.json"}, "--quality");
  with_png({"--presets", "presets.json", "--quality", "50", "--case", "relief"}, "--case");
  with_png({"--presets", "presets.json", "--quality", "50", "--backend", "vulkan"},
           "no device '*' of backend 'vulkan'");
  with_png({"--case", "relief", "--backend", "metal"}, "metal");
  with_png({"--case", "cone?format=r8"}, "format r8 has room for 0 cone ratios");
  with_png({"--case", "relief", "--view", "below"}, "--view");
  with_png({"--case", "relief", "--tiling", "0"}, "--tiling");
  with_png({"--case", "relief", "--size-px", "48"}, "--size-px");
  with_png({"--case", "relief", "--frames", "3"}, "--frames");
  with_png({"--case", "relief", "--backend", "null", "--device", "99"}, "99", 3);
  expect_refused({"--case", "relief", "--backend", "null", "--png", "no/view.png"}, 2,
                 "no/view.png: cannot be written");
  const CommandResult missing = run_reliefbench(
      {"view", "missing.png", "--case", "relief", "--backend", "null", "--png", "view.png"}, folder_.path());
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("missing.png"));
}

TEST_F(ViewCommandTest, without_a_display_names_png) {
  expect_refused({"--case", "relief", "--backend", "null"}, 3, "--png FILE draws without one");
}

TEST_F(ViewCommandTest, a_script_is_checked_before_a_window_opens) {
  const auto expect_line = [&](const std::string& script, const std::string& words) {
    write_atomically(folder_ / "tour.txt", script);
    expect_refused({"--script", "tour.txt"}, 2, words);
  };
  expect_line("set technique relief\nset cone_steps 4\n", "tour.txt:2: 'cone_steps' is unknown");
  expect_line("# only a comment\n\nwiat\n", "tour.txt:3: 'wiat' is unknown (did you mean 'wait'?");
  expect_line("set other relief?linear_steps=0\n", "tour.txt:1: ");
  expect_refused({"--script", "missing.txt"}, 2, "missing.txt");
  expect_refused({"--script", "tour.txt", "--png", "view.png"}, 2, "--png");
}

TEST_F(ViewCommandTest, a_run_that_is_no_help_is_refused_in_one_line) {
  const auto of_run = [&](std::vector<std::string> arguments, int exit_code, const std::string& words) {
    arguments.insert(arguments.begin(), "view");
    const CommandResult result = run_reliefbench(arguments, folder_.path());
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  };
  of_run({"run", "--scene", "rocks/top"}, 2,
         "has no front of scene 'rocks/top' and backend '*'; it has fbm_32x32/oblique on null");
  of_run({"run", "--backend", "vulkan"}, 2, "has no front of scene '*' and backend 'vulkan'");
  of_run({"run", "--presets", "presets.json", "--quality", "50"}, 2, "run is a run's folder");
  of_run({"cache"}, 2, "cache: is a folder, but no run's or tune's: it has no run.json");
  of_run({}, 2, "view needs a HEIGHTMAP, the folder of a run, --presets");
  of_run({"run"}, 3, "--png FILE draws without one");  // it would be shown
}

}  // namespace
}  // namespace reliefbench
