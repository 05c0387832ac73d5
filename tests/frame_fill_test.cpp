// Frames that are too small to fill a device are found out, and said wherever times are read.
#include "tuner/results/frame_fill.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "kernels/base/error.h"
#include "tests/forwarding_backend.h"
#include "tests/temp_folder.h"
#include "tuner/measure/session.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/config.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Hardware as the null device draws, and beside that a fixed time for each frame.
class SlowToStart final : public ForwardingBackend {
 public:
  SlowToStart(std::unique_ptr<Backend> inner, double frame_ns, bool is_software)
      : ForwardingBackend(std::move(inner)), frame_ns_(frame_ns) {
    info_.software = is_software;
  }
  BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override {
    BatchTime time = ForwardingBackend::render(frame, frames, timer);
    time.wall_ns += frames * frame_ns_;
    return time;
  }

 private:
  double frame_ns_;
};

OpenDevice slow_to_start(double frame_ns, bool is_software = false) {
  return [=](const BackendRow& row, int index) -> std::unique_ptr<Backend> {
    return std::make_unique<SlowToStart>(row.open(index, {}), frame_ns, is_software);
  };
}

SceneSpec scene_of(int width_px, int height_px) {
  return {.id = "any", .heightmap = {}, .scene = {.view = {}, .width_px = width_px, .height_px = height_px}};
}

std::vector<FrameFill> fills_of(double frame_ns, const std::vector<SceneSpec>& scenes, bool is_software = false) {
  WallSplit split;
  Session session(find_backend("null"), 0, split, {.open = slow_to_start(frame_ns, is_software)});
  session.calibrate(1, nullptr);
  session.measure_fills(scenes);
  return session.fills();
}

/// Of the control case.
double null_pixel_ns() {
  WallSplit split;
  Session session(find_backend("null"), 0, split);
  session.calibrate(1, nullptr);
  return session.calibration().reference_ns / (256 * 256);
}

TEST(FrameFill, tells_what_a_pixel_costs_beside_one_of_a_larger_frame) {
  const double pixel_ns = null_pixel_ns();
  for (const double overhead : {0.0, 0.3, 2.0}) {  // of a frame of 64 x 32, in its pixels' time
    const std::vector<FrameFill> fills = fills_of(overhead * 64 * 32 * pixel_ns, {scene_of(64, 32), scene_of(64, 32)});
    ASSERT_EQ(fills.size(), 1U);
    EXPECT_EQ(fills[0].width_px, 64);
    EXPECT_EQ(fills[0].height_px, 32);
    EXPECT_NEAR(fills[0].pixel_cost, (1 + overhead) / (1 + overhead / 4), 0.03 * (1 + overhead));
    EXPECT_EQ(fills[0].is_too_small(), overhead > 0);
  }
}

TEST(FrameFill, is_measured_of_every_size_that_is_less_than_a_screen_and_of_hardware_alone) {
  const std::vector<SceneSpec> scenes{scene_of(256, 256), scene_of(1280, 720), scene_of(1920, 1080),
                                      scene_of(3840, 2160)};
  const std::vector<FrameFill> fills = fills_of(0, scenes);
  ASSERT_EQ(fills.size(), 2U);
  EXPECT_EQ(fills[1].height_px, 720);
  EXPECT_THAT(fills_of(1e6, scenes, true), IsEmpty());
}

TEST(FrameFill, is_said_of_frames_that_are_too_small) {
  const nlohmann::json info = {
      {"devices",
       {{{"name", "H200"},
         {"backend", "vulkan"},
         {"frame_fill", fills_json(std::vector<FrameFill>{{256, 256, 1.312}, {1280, 720, 1.04}})}},
        {{"name", "llvmpipe"}, {"backend", "opengl"}}}}};
  EXPECT_THAT(small_frame_notes(info),
              ElementsAre(HasSubstr("frames of 256x256 do not fill H200 (vulkan): a pixel costs 1.31 times")));
  EXPECT_THAT(small_frame_notes(nlohmann::json::object()), IsEmpty());
  const nlohmann::json torn = {{"devices", {{{"name", "x"}, {"frame_fill", {{{"frame_px", {256}}}}}}}}};
  EXPECT_THROW((void)small_frame_notes(torn), Error);
}

TEST(FrameFill, stands_in_the_run_and_in_what_the_sweep_says) {
  const TempFolder folder;
  const Config config = parse_config(R"({
    "scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique", "frame_px": [16, 16]}],
    "measure": {"samples": 2, "batch_ms": 0.01, "warmup_batches_max": 1, "flicker_frames": 0},
    "sweeps": [{"technique": "relief", "axes": {"linear_steps": 4, "refinement": "none"}}]})",
                                     "config.json");
  const SweepSummary summary =
      run_sweep(config, {.output = folder / "run", .backends = {"null"}, .quiet = true, .open = slow_to_start(1e6)});
  ASSERT_EQ(summary.notes.size(), 1U);
  EXPECT_THAT(summary.notes[0], HasSubstr("frames of 16x16 do not fill"));
  EXPECT_EQ(small_frame_notes(load_run(folder / "run").info), summary.notes);
}

}  // namespace
}  // namespace reliefbench
