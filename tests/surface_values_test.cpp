// What features make of hits on curved surfaces: the light's exact share against analytic cases and a slow march,
// depths against the ways to analytic hits, and the rows of `shadow` and `depth` on both backends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "kernels/judge/light.h"
#include "kernels/trace/depth.h"
#include "kernels/trace/guarantee.h"
#include "kernels/trace/surface.h"
#include "kernels/trace/surface_tracer.h"
#include "tests/technique_rig.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

constexpr std::array kShapes{SurfaceKind::cylinder, SurfaceKind::sphere, SurfaceKind::torus};

Scene lit_scene(SurfaceKind kind, double relief_depth, int side_px, double round = 4) {
  return {.view = {.id = "whole", .elevation_deg = 35, .distance = 2.6, .fov_deg = 40, .azimuth_deg = 20},
          .relief_depth = relief_depth,
          .width_px = side_px,
          .height_px = side_px,
          .light = {.elevation_deg = 25, .azimuth_deg = 205},
          .surface = {.kind = kind, .round = round}};
}

/// The exact hits of all pixels of a frame, and what they are hits of.
struct ExactFrame {
  ExactFrame(const Heightfield& heights, const Scene& scene)
      : tracer(heights, scene.wrap), frame(frame_uniforms(scene, heights.width, heights.height)), shape(frame) {
    for (int y = 0; y < scene.height_px; ++y)
      for (int x = 0; x < scene.width_px; ++x) pixels.push_back(pixel_ray(frame, scene.wrap, x, y));
    hits = exact_hits(tracer, frame, scene.wrap, pixels);
    for (int i = 0; i < 3; ++i)
      light.direction.at(static_cast<std::size_t>(i)) =
          static_cast<double>(frame.light.at(static_cast<std::size_t>(i)));
  }
  [[nodiscard]] SurfaceRay ray(std::size_t i) const {
    const auto width = static_cast<std::size_t>(frame.sizes[0]);
    return surface_ray(frame, shape, tracer.wrap(), static_cast<int>(i % width), static_cast<int>(i / width));
  }

  ReferenceTracer tracer;
  FrameUniforms frame;
  SurfaceShape shape;
  LightSource light{};
  std::vector<ScorePixel> pixels{};
  std::vector<ReferenceHit> hits{};
};

double dot_of(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Heightfield level(float height) { return {.width = 16, .height = 16, .texels = std::vector<float>(16 * 16, height)}; }

// A body that bulges everywhere shades itself where it looks away from the light, and nowhere else.
TEST(SurfaceLight, of_a_round_body_is_what_faces_it) {
  for (const SurfaceKind kind : {SurfaceKind::cylinder, SurfaceKind::sphere})
    for (const float height : {1.0F, 0.5F}) {
      const ExactFrame exact(level(height), lit_scene(kind, 0.08, 48));
      const std::vector<float> shares = exact_light(exact.tracer, exact.light, exact.frame, exact.hits);
      int lit = 0;
      int dark = 0;
      for (std::size_t i = 0; i < shares.size(); ++i) {
        const SurfaceRay ray = exact.ray(i);
        if (!ray.enters || exact.hits[i].passes()) {
          ASSERT_EQ(shares[i], 0);
          continue;
        }
        const Point3 normal = exact.shape.place_of(ray.at(exact.hits[i].t_enter)).normal;
        const double cosine = dot_of(normal, exact.light.direction);
        if (std::abs(cosine) < 1e-3) continue;
        ASSERT_EQ(shares[i], cosine > 0 ? 1 : 0) << surface_row(kind).id << " pixel " << i;
        ++(cosine > 0 ? lit : dark);
      }
      EXPECT_GT(lit, 100);
      EXPECT_GT(dark, 20);
    }
}

/// Whether a way in small steps, from `lift` heights over the hit to the top plate, is over the surface all along.
bool is_lit_slowly(const ExactFrame& exact, const Heightfield& heights, std::size_t i, double lift) {
  const SurfaceShape& shape = exact.shape;
  Point3 at = exact.ray(i).at(exact.hits[i].t_enter);
  const Point3 normal = shape.place_of(at).normal;
  for (std::size_t axis = 0; axis < 3; ++axis) at.at(axis) += lift * shape.relief * normal.at(axis);
  const double step = 2e-4;
  for (int n = 0; n < 20000; ++n) {
    const Located there = shape.locate(at, exact.light.direction, 0);
    if (there.height.value > 1) return true;
    const double surface = 1 - gap_above(heights, exact.tracer.wrap(),
                                         {.u = static_cast<float>(there.u.value * shape.tiling),
                                          .v = static_cast<float>(there.v.value * shape.tiling)},
                                         0);
    if (there.height.value < surface) return false;
    for (std::size_t axis = 0; axis < 3; ++axis) at.at(axis) += step * exact.light.direction.at(axis);
  }
  return true;
}

TEST(SurfaceLight, is_what_a_slow_march_finds) {
  const Heightfield heights = small_fbm();
  for (const SurfaceKind kind : kShapes) {
    const ExactFrame exact(heights, lit_scene(kind, kind == SurfaceKind::torus ? 0.12 : 0.2, 20));
    const std::vector<float> shares = exact_light(exact.tracer, exact.light, exact.frame, exact.hits);
    int lit = 0;
    int dark = 0;
    int differing = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
      if (!exact.ray(i).enters || exact.hits[i].passes()) continue;
      // The march steps over thin shadows, and floats blur the place: what differs with the lift is not asked.
      const bool low = is_lit_slowly(exact, heights, i, 1e-4);
      const bool high = is_lit_slowly(exact, heights, i, 4e-3);
      if (low != high) continue;
      differing += shares[i] == (low ? 1 : 0) ? 0 : 1;
      ++(low ? lit : dark);
    }
    EXPECT_LE(differing, 3) << surface_row(kind).id;
    EXPECT_GT(lit, 40) << surface_row(kind).id;
    EXPECT_GT(dark, 8) << surface_row(kind).id;
  }
}

// The middle of each part of a disc counts as one direction does.
TEST(SurfaceLight, of_a_disc_is_the_mean_of_its_directions) {
  const ExactFrame exact(small_fbm(), lit_scene(SurfaceKind::sphere, 0.2, 12));
  LightSource disc = exact.light;
  disc.radius = 0.3;
  const std::vector<float> shares = exact_light(exact.tracer, disc, exact.frame, exact.hits);
  std::vector<double> sums(shares.size());
  for (const Point3& direction : light_directions(disc)) {
    const std::vector<float> one =
        exact_light(exact.tracer, {.direction = direction, .radius = 0}, exact.frame, exact.hits);
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += static_cast<double>(one[i]);
  }
  int partly = 0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    EXPECT_NEAR(shares[i], sums[i] / (kLightStrata * kLightStrata), 1e-6);
    partly += shares[i] > 0 && shares[i] < 1 ? 1 : 0;
  }
  EXPECT_GT(partly, 5);
}

// A depth is a length along the axis: that of the world's point where the ray meets the displaced surface.
TEST(SurfaceDepth, is_that_of_the_hit_in_the_world) {
  for (const SurfaceKind kind : kShapes) {
    const ExactFrame exact(small_fbm(), lit_scene(kind, 0.12, 32));
    const std::vector<float> depths = exact_depth(exact.frame, exact.tracer.wrap(), exact.hits);
    int seen = 0;
    for (std::size_t i = 0; i < depths.size(); ++i) {
      const SurfaceRay ray = exact.ray(i);
      if (!ray.enters || exact.hits[i].passes()) {
        ASSERT_EQ(depths[i], kFarthest);
        continue;
      }
      const Point3 hit = ray.at(exact.hits[i].t_enter);
      double along = 0;
      for (std::size_t axis = 0; axis < 3; ++axis)
        along += static_cast<double>(exact.frame.forward.at(axis)) *
                 (hit.at(axis) - static_cast<double>(exact.frame.position.at(axis)));
      ASSERT_NEAR(depths[i], window_depth(exact.frame, along), 2e-7) << surface_row(kind).id;
      ++seen;
    }
    EXPECT_GT(seen, 100);
  }
}

using SurfaceValuesTest = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, SurfaceValuesTest, ::testing::Values("opengl", "vulkan"),
                         [](const auto& parameter) { return std::string(parameter.param); });

/// A frame's judged hits with what its features found.
FrameScore valued_score(const Rig& rig, const Settings& settings, const Heightfield& heights, const Scene& scene) {
  const StoredMap map = store_map(settings, heights, scene.wrap);
  const std::vector<ScorePixel> pixels = trace_frame(rig, settings, map, scene);
  const std::vector<PixelFeature> features = pixel_features(settings);
  const FeatureValues found = rig.backend->read_values(features);
  const FrameUniforms frame = frame_uniforms(scene, heights.width, heights.height);
  const ReferenceTracer tracer(map.surface, scene.wrap);
  const std::vector<ReferenceHit> hits = exact_hits(tracer, frame, scene.wrap, pixels);
  JudgedFrame judged = judge(frame, scene.wrap, false, pixels, hits);
  judge_features(features, found, exact_values(features, tracer, frame, rays_of(pixels), hits), judged.pixels,
                 judged.score);
  for (std::size_t i = 0; i < features.size(); ++i)
    EXPECT_EQ(features[i].feature->value->broken(tracer, frame, pixels, found[i]), 0) << settings.text();
  return judged.score;
}

// On a body as good as flat, shadows are those of the plane; on a rounder one they are off by what it falls away.
TEST_P(SurfaceValuesTest, shadows_are_the_exact_ones_where_the_surface_is_nearly_flat) {
  on_every_device([](const Rig& rig) {
    const auto score = [&](double round, const char* shadow) {
      const Settings settings = settings_of("cone", {{"format", "rg32f"},
                                                     {"encoding", "ratio"},
                                                     {"cone_steps", "2000"},
                                                     {"filter", "manual"},
                                                     {"silhouette", "quadric"},
                                                     {"shadow", shadow},
                                                     {"shadow_steps", "2000"}});
      Scene scene = lit_scene(SurfaceKind::sphere, 0.08, 40, round);
      scene.light.elevation_deg = 12;
      scene.view = {.id = "near", .elevation_deg = 50, .distance = 0.6, .fov_deg = 40, .azimuth_deg = 20};
      return valued_score(rig, settings, small_fbm(), scene);
    };
    for (const char* shadow : {"cone", "binary"}) {
      SCOPED_TRACE(shadow);
      const FrameScore flat = score(400, shadow);
      EXPECT_LT(flat.at("false_lit_rate") + flat.at("false_dark_rate"), 0.01);
      const FrameScore rounder = score(4, shadow);
      EXPECT_GT(rounder.at("false_dark_rate"), flat.at("false_dark_rate") + 0.005);
      EXPECT_LT(rounder.at("false_lit_rate") + rounder.at("false_dark_rate"), 0.2);
    }
  });
}

TEST_P(SurfaceValuesTest, every_shadow_and_depth_is_drawn_on_every_surface_and_silhouette) {
  on_every_device([](const Rig& rig) {
    std::size_t number = 0;
    for (const SurfaceKind kind : kShapes)
      for (const std::string setting :
           {"shadow=linear", "shadow=binary", "shadow=cone&silhouette=quadric", "shadow=soft_taps", "shadow=soft_cone",
            "shadow=linear&silhouette=quadric", "depth=write", "depth=write&silhouette=quadric",
            "depth=rtm&silhouette=quadric"}) {
        if (!is_tried_here(rig, number++)) continue;
        const Settings settings =
            parse_setting("cone?cone_steps=500&format=rg32f&encoding=ratio&filter=manual&" + setting);
        const FrameScore score = valued_score(rig, settings, small_fbm(), lit_scene(kind, 0.06, 32));
        EXPECT_GT(score.pixels, 50) << setting;
        if (setting.starts_with("shadow")) {
          EXPECT_LT(score.at("false_lit_rate"), 0.25) << surface_row(kind).id << " " << setting;
        } else if (setting.ends_with("quadric")) {
          EXPECT_LT(score.at("e_depth"), 2e-3) << surface_row(kind).id << " " << setting;
        }
      }
  });
}

TEST(SurfaceValues, what_a_surface_does_not_have_is_refused) {
  const auto why = [](std::string_view setting, SurfaceKind kind) {
    return conflict(parse_setting(setting), lit_scene(kind, 0.08, 16), false);
  };
  EXPECT_EQ(why("cone?shadow=cone", SurfaceKind::sphere), "");
  EXPECT_EQ(why("cone?depth=write&silhouette=quadric", SurfaceKind::torus), "");
  EXPECT_THAT(why("cone?depth=conservative", SurfaceKind::sphere), testing::HasSubstr("needs a plane"));
  EXPECT_THAT(why("cone?shadow=linear", SurfaceKind::mesh), testing::HasSubstr("not a mesh"));
}

}  // namespace
}  // namespace reliefbench
