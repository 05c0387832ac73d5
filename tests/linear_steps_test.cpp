// How many equal steps a ray takes, where the first one ends, and equal steps again inside the bracket that they leave.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "tests/technique_rig.h"
#include "tuner/measure/frame_draws.h"
#include "tuner/measure/prepare.h"

namespace reliefbench {
namespace {

using LinearStepsTest = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, LinearStepsTest, ::testing::Values("opengl", "vulkan"), backend_name);

constexpr int kMost = 40;
constexpr int kLeast = 6;
constexpr double kReliefDepth = 0.2;
const Scene kScene{
    .view = {.id = "steep", .elevation_deg = 35}, .relief_depth = kReliefDepth, .width_px = 48, .height_px = 32};

double length_of(const TextureRay& ray, double width, double height) {
  return std::hypot(static_cast<double>(ray.slope_u) * width, static_cast<double>(ray.slope_v) * height);
}

/// From the formulas of the engines that pace their marches so, in double.
double expected_steps(std::string_view by, const TextureRay& ray, double side, double texels_a_step) {
  const double slope = length_of(ray, 1, 1);
  if (by == "view") return std::lerp(kMost, kLeast, 1 / std::hypot(1.0, slope / kReliefDepth));
  if (by == "slope") return std::lerp(kLeast, kMost, std::atan(slope) / (M_PI / 2));
  if (by == "length") return std::clamp(length_of(ray, side, side) / texels_a_step, 1.0 * kLeast, 1.0 * kMost);
  return kMost;
}

// At the bottom everywhere: every ray takes all of its steps.
TEST_P(LinearStepsTest, are_as_many_as_the_rule_says) {
  const Heightfield bottom{.width = 64, .height = 64, .texels = std::vector<float>(64 * 64, 0)};
  on_every_device([&](const Rig& rig) {
    for (const std::string_view by : {"count", "view", "slope", "length"}) {
      const Settings settings = settings_of("relief", {{"linear_steps", "40"},
                                                       {"steps_by", by},
                                                       {"least_steps", "6"},
                                                       {"texels_a_step", "3"},
                                                       {"refinement", "none"},
                                                       {"loop", "fixed"}});
      const StoredMap map = store_map(settings, bottom, kScene.wrap);
      double fewest = kMost;
      for (const ScorePixel& pixel : trace_frame(rig, settings, map, kScene)) {
        if (pixel.status == 0) continue;
        const double expected = expected_steps(by, pixel.ray, 64, 3);
        ASSERT_GE(pixel.steps, std::ceil(expected - 1e-3)) << by;
        ASSERT_LE(pixel.steps, std::ceil(expected + 1e-3)) << by;
        fewest = std::min(fewest, expected);
      }
      EXPECT_EQ(by == "count", fewest == kMost);  // the rule does something here
    }
  });
}

/// Of dither.glsl, from the published sequence: the fractions of x / p + y / p^2 with p^3 = p + 1, and of the frame.
double dither_phase(int x, int y, int frame) {
  constexpr double kPlastic = 1.32471795724474602596;
  const double share = x / kPlastic + y / (kPlastic * kPlastic) + frame / 8.0;
  return share - std::floor(share);
}

double around(double share) { return std::abs(share - std::round(share)); }

/// Hits of one frame of those that a setting goes through.
std::vector<ScorePixel> dithered_frame(const Rig& rig, const Settings& settings, const StoredMap& map, int number) {
  const auto pipeline = score_pipeline(rig, settings, kScene.wrap);
  const auto relief = rig.backend->upload(texture_desc(map.textures.relief, kScene.wrap));
  Draw draw{.pipeline = pipeline.get(),
            .textures = rig.textures(relief.get(), nullptr),
            .frame = frame_uniforms(kScene, map.surface.width, map.surface.height)};
  draw.frame.argument() = static_cast<float>(number);
  return trace_frame(*rig.backend, draw);
}

// Over a plate half-way down every ray ends at its first step under it, which tells where the steps were.
TEST_P(LinearStepsTest, end_where_the_dither_says) {
  const Heightfield plate{.width = 64, .height = 64, .texels = std::vector<float>(64 * 64, 0.5)};
  constexpr int kSteps = 9;
  const Settings settings = settings_of(
      "relief", {{"linear_steps", "9"}, {"dither", "temporal"}, {"refinement", "none"}, {"format", "r32f"}});
  const StoredMap map = store_map(settings, plate, kScene.wrap);
  on_every_device([&](const Rig& rig) {
    std::vector<double> sums(static_cast<std::size_t>(kScene.width_px * kScene.height_px));
    for (int number = 0; number < kDitherFrames; ++number) {
      const std::vector<ScorePixel> pixels = dithered_frame(rig, settings, map, number);
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (pixels[i].status == 0) continue;
        const int at = static_cast<int>(i);
        const double phase = dither_phase(at % kScene.width_px, at / kScene.width_px, number);
        const double t = static_cast<double>(pixels[i].t);
        ASSERT_LT(around(t * kSteps + phase), 1e-5) << i;
        ASSERT_GE(t, 0.5);
        ASSERT_LT(t, 0.5 + 1.0 / kSteps + 1e-6);
        sums[i] += t;
      }
    }
    // Evenly apart: their mean is off by half a step, give or take half of an eighth of one.
    EXPECT_GT(*std::ranges::max_element(sums), 0);
    for (const double sum : sums)
      if (sum > 0) {
        ASSERT_NEAR(sum / kDitherFrames, 0.5 + 0.5 / kSteps, 0.5 / kSteps / kDitherFrames + 1e-6);
      }
  });
}

// The way down is as long as ever: whatever the phase, a ray meets the bottom, within its steps.
TEST_P(LinearStepsTest, of_dithered_rays_reach_the_bottom) {
  const Heightfield bottom{.width = 64, .height = 64, .texels = std::vector<float>(64 * 64, 0)};
  on_every_device([&](const Rig& rig) {
    for (const char* steps : {"1", "3", "64"}) {
      const Settings settings = settings_of(
          "relief", {{"linear_steps", steps}, {"dither", "pixel"}, {"refinement", "binary"}, {"binary_steps", "24"}});
      const StoredMap map = store_map(settings, bottom, kScene.wrap);
      for (const ScorePixel& pixel : dithered_frame(rig, settings, map, 0)) {
        if (pixel.status == 0) continue;
        ASSERT_EQ(pixel.status, static_cast<float>(PixelStatus::hit));
        ASSERT_NEAR(pixel.t, 1, 1e-6) << steps;
        ASSERT_LE(pixel.steps, static_cast<float>(step_cap(settings)));
      }
    }
  });
}

// The first of the fine steps that is under the surface, in the bracket of the coarse ones.
TEST_P(LinearStepsTest, of_contact_refinement_end_at_the_first_under_the_surface) {
  on_every_device([&](const Rig& rig) {
    const auto hits_of = [&](std::string_view refinement, std::string_view steps) {
      const Settings settings = settings_of("relief", {{"linear_steps", steps},
                                                       {"refinement", refinement},
                                                       {"contact_steps", "16"},
                                                       {"format", "r32f"},
                                                       {"filter", "manual"}});
      return trace_frame(rig, settings, store_map(settings, small_fbm(), kScene.wrap), kScene);
    };
    const std::vector<ScorePixel> coarse = hits_of("none", "16");
    const std::vector<ScorePixel> contact = hits_of("contact", "16");
    const std::vector<ScorePixel> fine = hits_of("none", "256");
    int finer = 0;
    int same = 0;
    int hits = 0;
    for (std::size_t i = 0; i < contact.size(); ++i) {
      if (contact[i].status == 0) continue;
      ++hits;
      ASSERT_LE(contact[i].t, coarse[i].t);
      ASSERT_GE(contact[i].t, coarse[i].t - 1.0F / 16);
      ASSERT_NEAR(contact[i].t * 256, std::round(contact[i].t * 256), 1e-3);
      // The fine march meets what the coarse one stepped over; it never ends later.
      ASSERT_LE(fine[i].t, contact[i].t + 1e-6F);
      finer += contact[i].t < coarse[i].t ? 1 : 0;
      same += std::abs(fine[i].t - contact[i].t) < 1e-6F ? 1 : 0;
    }
    EXPECT_GT(finer, hits / 2);
    EXPECT_GT(same, hits * 9 / 10);
  });
}

/// Few steps down a real relief.
struct DitheredScene {
  explicit DitheredScene(std::string_view its_backend) : backend(its_backend) {}
  [[nodiscard]] Case case_of(std::string_view dither) const {
    return {.settings = settings_of("relief", {{"linear_steps", "5"}, {"dither", dither}, {"refinement", "none"}}),
            .scene_id = spec.id,
            .backend = std::string(backend)};
  }
  std::string_view backend;
  SceneSpec spec{.id = "bricks/steep", .heightmap = {.source = "bricks", .width = 64, .height = 64}, .scene = kScene};
  WallSplit split{};
  Cache cache = Cache::open();
  MapLibrary library{cache, split};
  Session session{find_backend(backend), 0, split, {.audits = Audits::none}};
  Preparer preparer{
      {.session = session, .library = library, .cache = cache, .split = split, .timeout_s = 20, .flicker_frames = 2}};
};

TEST_P(LinearStepsTest, are_seen_as_the_mean_of_the_frames_they_go_through) {
  DitheredScene seen(GetParam());
  const Case c = seen.case_of("temporal");
  const std::vector<std::uint8_t> picture = seen.preparer.pictures(c, seen.spec).frame;

  Backend& backend = seen.session.backend();
  const UploadedScene scene = upload(backend, seen.spec.scene, seen.library.heights(seen.spec));
  const Frame frame = upload(backend, seen.library.packed(c.settings, seen.spec), scene);
  std::vector<int> sums(picture.size());
  std::set<std::vector<std::uint8_t>> frames;
  for (int number = 0; number < kDitherFrames; ++number) {
    Draw relief = frame.draw;
    relief.frame.argument() = static_cast<float>(number);
    const std::vector<std::uint8_t> one =
        shade_frame(backend, shaded_draws(seen.session, c.settings, seen.spec.scene, relief));
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += one[i];
    frames.insert(one);
  }
  EXPECT_EQ(frames.size(), static_cast<std::size_t>(kDitherFrames));
  for (std::size_t i = 0; i < sums.size(); ++i) ASSERT_EQ(picture[i], (sums[i] + kDitherFrames / 2) / kDitherFrames);
}

// What the mean is for: people see less of the steps, standing and moving.
TEST_P(LinearStepsTest, show_less_where_frames_are_dithered) {
  DitheredScene seen(GetParam());
  std::map<std::string_view, FrameScore> scores;
  for (const char* dither : {"none", "pixel", "temporal"}) {
    const Case c = seen.case_of(dither);
    const PreparedCase prepared = seen.preparer.prepare(c, seen.spec);
    ASSERT_EQ(prepared.record.status, Status::ok) << prepared.record.reason;
    scores[dither] = prepared.record.error.value();
  }
  EXPECT_LT(scores["temporal"].at("flip"), scores["pixel"].at("flip"));
  EXPECT_LT(scores["temporal"].at("flip"), scores["none"].at("flip"));
  EXPECT_LT(scores["temporal"].at("flicker"), scores["pixel"].at("flicker"));
  EXPECT_EQ(scores["temporal"].at("e_xy.p99"), scores["pixel"].at("e_xy.p99"));  // hits are those of one frame
}

}  // namespace
}  // namespace reliefbench
