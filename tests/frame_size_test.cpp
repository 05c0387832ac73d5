// How large frames are whose scene does not say it: 1080p where hardware draws them, and always as a run was begun.
#include "tuner/measure/frame_size.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/faulty_device.h"
#include "tests/own_cache.h"
#include "tests/temp_folder.h"
#include "tuner/measure/run_info.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"
#include "tuner/tune/tune_run.h"

namespace reliefbench {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

DeviceInfo device_of(const std::string& name, const std::string& backend, bool is_software) {
  DeviceInfo device;
  device.backend = backend;
  device.name = name;
  device.software = is_software;
  return device;
}
const DeviceInfo kGpu = device_of("H200", "vulkan", false);
const DeviceInfo kRasteriser = device_of("llvmpipe", "opengl", true);

TEST(DefaultFrame, one_device_that_is_hardware_decides_for_all) {
  const std::string asked = " where nothing else is asked for (frame_px, --frame-px), since ";
  const DefaultFrame software = default_frame(std::vector{kRasteriser});
  EXPECT_FALSE(software.size_px);
  EXPECT_EQ(software.why, "frames are 256x256" + asked + "no device is hardware");
  const DefaultFrame hardware = default_frame(std::vector{kGpu});
  EXPECT_EQ(hardware.size_px, (Size{1920, 1080}));
  EXPECT_EQ(hardware.why, "frames are 1920x1080" + asked + "H200 (vulkan) is hardware");
  const DefaultFrame both = default_frame(std::vector{kRasteriser, kGpu});
  EXPECT_EQ(both.size_px, (Size{1920, 1080}));
  EXPECT_EQ(both.why, hardware.why + "; llvmpipe (opengl) draws the same");
  EXPECT_THAT(default_frame({}).why, StartsWith("frames are 1920x1080 on hardware and 256x256 on software"));
}

/// One tiny scene whose frame's size is said by `frame`, a member with a comma in front, and one that says 16x16.
Config config_of(const std::string& frame = "", const std::string& list = "[") {
  return parse_config(R"({ "scenes": )" + list +
                          R"({"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique")" + frame +
                          (list.empty() ? "}" : R"(},
      {"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "top", "frame_px": [16, 16]}])") +
                          R"(, // a comment
    "measure": {"samples": 2, "batch_ms": 0.01, "warmup_batches_max": 1, "flicker_frames": 0},
    "sweeps": [{"technique": "flat"}]})",
                      "config.json");
}

std::vector<Size> sizes_of(std::span<const SceneSpec> scenes) {
  std::vector<Size> sizes;
  for (const SceneSpec& spec : scenes) sizes.push_back({spec.scene.width_px, spec.scene.height_px});
  return sizes;
}

TEST(DefaultFrame, is_for_scenes_that_say_none_and_stands_in_the_text) {
  for (const std::string list : {"[", ""}) {
    Config config = config_of("", list);
    const Config before = config;
    EXPECT_TRUE(has_default_frames(config.scenes));
    set_default_frames(config, {.size_px = std::nullopt, .why = ""});
    EXPECT_EQ(config_sha256(config), config_sha256(before));  // runs of software rasterisers are gone on with
    set_default_frames(config, {.size_px = Size{48, 32}, .why = ""});
    EXPECT_EQ(sizes_of(config.scenes).front(), (Size{48, 32}));
    EXPECT_EQ(sizes_of(config.scenes).back(), list.empty() ? (Size{48, 32}) : (Size{16, 16}));
    EXPECT_NE(config_sha256(config), config_sha256(before));
    const Config again = parse_config(config.text, "config.json");
    EXPECT_EQ(sizes_of(again.scenes), sizes_of(config.scenes));
    EXPECT_FALSE(has_default_frames(again.scenes));
    EXPECT_EQ(config.sweeps.front().line, before.sweeps.front().line);  // of the file that a person wrote
  }
  Config all = config_of(R"(, "frame_px": "720p")");
  EXPECT_FALSE(has_default_frames(all.scenes));
  set_frames(all, {48, 32});
  EXPECT_THAT(sizes_of(all.scenes), Each((Size{48, 32})));
  EXPECT_EQ(sizes_of(parse_config(all.text, "config.json").scenes), sizes_of(all.scenes));
}

class FrameSizeTest : public ::testing::Test {
 protected:
  SweepSummary sweep(const Config& config, bool is_hardware, const std::string& name = "run") {
    FaultyDevices devices;
    if (is_hardware) devices.be_hardware();
    return run_sweep(config, {.output = folder_ / name,
                              .backends = {"null"},
                              .pictures = Pictured::none,
                              .quiet = true,
                              .open = devices.opener()});
  }
  [[nodiscard]] std::vector<Size> sizes(const std::string& name = "run") const {
    std::vector<SceneSpec> scenes;
    for (const MeasuredScene& scene : load_run(folder_ / name).scenes) {
      EXPECT_EQ(scene.key, scene_key(scene.heights_sha256, scene.spec.scene));
      scenes.push_back(scene.spec);
    }
    return sizes_of(scenes);
  }

  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

TEST_F(FrameSizeTest, hardware_draws_1080p_and_software_what_it_drew) {
  const SweepSummary hardware = sweep(config_of(), true, "hardware");
  EXPECT_THAT(sizes("hardware"), ElementsAre((Size{1920, 1080}), (Size{16, 16})));
  EXPECT_THAT(hardware.notes.front(), HasSubstr("since null (null) is hardware"));
  const reliefbench::Run run = load_run(folder_ / "hardware");
  EXPECT_EQ(run.info["config"]["scenes"][0]["frame_px"], (nlohmann::json{1920, 1080}));
  for (const Record& record : run.records) EXPECT_EQ(record.status, Status::ok) << record.reason;
  EXPECT_EQ(sweep(config_of(), true, "hardware").resumed, 2);

  const SweepSummary software = sweep(config_of(), false, "software");
  EXPECT_THAT(sizes("software"), ElementsAre((Size{256, 256}), (Size{16, 16})));
  EXPECT_THAT(software.notes, ElementsAre(HasSubstr("since no device is hardware")));
  EXPECT_EQ(load_run(folder_ / "software").info["identity"]["config_sha256"], config_sha256(config_of()));
  EXPECT_THAT(sweep(config_of(R"(, "frame_px": [24, 24])"), false, "said").notes, IsEmpty());
}

TEST_F(FrameSizeTest, a_run_goes_on_as_it_was_begun) {
  (void)sweep(config_of(), false);  // as runs of before hardware had another size
  const SweepSummary small = sweep(config_of(), true);
  EXPECT_EQ(small.resumed, 2);
  EXPECT_EQ(small.notes.front(), "frames are 256x256 where nothing else is asked for (frame_px, --frame-px), as when " +
                                     (folder_ / "run").string() + " was begun");

  Config said = config_of();
  set_default_frames(said, {.size_px = Size{48, 32}, .why = ""});
  (void)sweep(said, true, "said");
  for (const bool is_hardware : {true, false}) {
    const SweepSummary again = sweep(config_of(), is_hardware, "said");
    EXPECT_EQ(again.resumed, 2);
    EXPECT_THAT(again.notes.front(), HasSubstr("frames are 48x32"));
    EXPECT_THAT(again.notes.front(), HasSubstr("was begun"));
  }
  std::ofstream(folder_ / "said/run.json") << R"({"config": {"scenes": [{"frame_px": ["wide", -1]}]}})";
  EXPECT_THROW((void)sweep(config_of(), false, "said"), Error);  // as the folder says it
}

TEST_F(FrameSizeTest, a_tuning_does_likewise_with_what_it_holds_out) {
  const Config config = default_tune_config({.source = "fbm", .width = 16, .height = 16}, {});
  EXPECT_TRUE(has_default_frames(config.scenes));
  TuneOptions options{.output = folder_ / "tune", .backend = "null"};
  options.quiet = true;
  options.holdout = default_tune_config({.source = "spikes", .width = 16, .height = 16}, {}).scenes;
  FaultyDevices devices;
  devices.be_hardware();
  options.open = devices.opener();
  const TuneRun run(config, options);
  EXPECT_THAT(run.frame_choice(), HasSubstr("null (null) is hardware"));
  EXPECT_THAT(sizes_of(run.config().scenes), ElementsAre((Size{1920, 1080})));
  EXPECT_EQ(run.tuned().front().spec.scene.width_px, 1920);
  EXPECT_EQ(run.holdout().front().spec.scene.width_px, 1920);
  EXPECT_EQ(run.holdout().front().key,
            scene_key(run.holdout().front().heights_sha256, run.holdout().front().spec.scene));
}

TEST_F(FrameSizeTest, sweep_takes_one_for_all_scenes) {
  std::ofstream(folder_ / "config.json") << config_of().text;
  const auto command = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"sweep", "config.json", "--backend", "null"});
    return run_reliefbench(more, folder_.path());
  };
  const CommandResult plan = command({"--dry-run"});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, HasSubstr("frames are 256x256 where"));
  EXPECT_THAT(command({"--dry-run", "--frame-px", "720p"}).out, ::testing::Not(HasSubstr("frames are")));
  const CommandResult swept = command({"--frame-px", "48x32", "-o", "out", "--pictures", "none"});
  EXPECT_EQ(swept.exit_code, 0) << swept.err;
  EXPECT_THAT(sizes("out"), Each((Size{48, 32})));
  const CommandResult refused = command({"--frame-px", "48x0", "--dry-run"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--frame-px: 0 is out of range"));
  const CommandResult said = command({"-o", "by_default", "--pictures", "none"});
  EXPECT_THAT(said.err, HasSubstr("frames are 256x256 where"));
}

TEST_F(FrameSizeTest, of_claims_is_spelt_as_everywhere) {
  const CommandResult wrong = run_reliefbench({"claims", "--frame-px", "1080"}, folder_.path());
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--frame-px 1080: expected WIDTHxHEIGHT in pixels"));
}

}  // namespace
}  // namespace reliefbench
