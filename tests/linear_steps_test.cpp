// How many equal steps a ray takes, and equal steps again inside the bracket that they leave.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/technique_rig.h"

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

}  // namespace
}  // namespace reliefbench
