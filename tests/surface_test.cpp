// Curved surfaces: what does not fit on them, the shaders' rays against the C++ twin, every technique and silhouette on
// both backends.
#include "kernels/trace/surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "kernels/trace/guarantee.h"
#include "kernels/trace/surface_tracer.h"
#include "tests/curved_scene.h"
#include "tests/technique_rig.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

TEST(Surface, faults_are_said_in_a_line) {
  const auto fault = [](Surface surface, double depth = 0.1, Wrap wrap = Wrap::repeat, double tiling = 1) {
    return surface_fault({.view = {}, .relief_depth = depth, .tiling = tiling, .wrap = wrap, .surface = surface});
  };
  EXPECT_EQ(fault({}), "");
  for (const SurfaceKind kind : kCurved) EXPECT_EQ(fault({.kind = kind}), "");
  EXPECT_THAT(fault({.kind = SurfaceKind::sphere, .round = 0.5}), HasSubstr("radius"));
  EXPECT_THAT(fault({.kind = SurfaceKind::sphere, .round = 4.5}), HasSubstr("seam"));
  EXPECT_EQ(fault({.kind = SurfaceKind::sphere, .round = 4.5}, 0.1, Wrap::repeat, 2), "");
  EXPECT_EQ(fault({.kind = SurfaceKind::sphere, .round = 4.5}, 0.1, Wrap::clamp), "");
  EXPECT_THAT(fault({.kind = SurfaceKind::torus, .round = 2, .tube = 1}), HasSubstr("ring"));
  EXPECT_THAT(fault({.kind = SurfaceKind::cylinder, .round = 0.9}, 0.01, Wrap::clamp), HasSubstr("once"));
}

TEST(Surface, settings_and_scenes_that_do_not_fit_are_refused) {
  const Scene plane{.view = {}};
  const Scene sphere = curved_scene(SurfaceKind::sphere);
  const auto why = [](std::string_view setting, const Scene& scene) {
    return conflict(parse_setting(setting), scene, false);
  };
  EXPECT_EQ(why("cone?silhouette=quadric", sphere), "");
  EXPECT_THAT(why("cone?silhouette=quadric", plane), HasSubstr("needs a curved surface"));
  EXPECT_THAT(why("relief?silhouette=clip", sphere), HasSubstr("wrap=clamp"));
  EXPECT_EQ(why("relief?silhouette=clip", curved_scene(SurfaceKind::sphere, 0.1, Wrap::clamp)), "");
  EXPECT_THAT(why("depth_passes", sphere), HasSubstr("plane"));
  EXPECT_THAT(why("cone?silhouette=quadric_exact", sphere), HasSubstr("equal steps"));
  EXPECT_EQ(why("relief?silhouette=quadric_exact", sphere), "");
  EXPECT_THAT(why("cone?silhouette=quadric&over_relaxation=auto", sphere), HasSubstr("over_relaxation"));
  EXPECT_THAT(why("relief?silhouette=quadric&fade=distance", sphere), HasSubstr("fade"));
}

using SurfaceTest = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, SurfaceTest, ::testing::Values("opengl", "vulkan"),
                         [](const auto& parameter) { return std::string(parameter.param); });

// To float precision: the twin is in double. On the silhouette an ulp decides whether there is a ray.
TEST_P(SurfaceTest, has_the_rays_of_its_twin) {
  on_every_device([](const Rig& rig) {
    for (const SurfaceKind kind : kCurved)
      for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
        const Scene scene = curved_scene(kind, 0.08, wrap);
        const Settings flat = settings_of("flat");
        const std::vector<ScorePixel> pixels = trace_frame(rig, flat, store_map(flat, small_fbm(), wrap), scene);
        const FrameUniforms frame = frame_uniforms(scene, 32, 32);
        int other = 0;
        int rays = 0;
        for (int y = 0; y < scene.height_px; ++y)
          for (int x = 0; x < scene.width_px; ++x) {
            const ScorePixel& found = pixels[static_cast<std::size_t>(y * scene.width_px + x)];
            const ScorePixel expected = pixel_ray(frame, wrap, x, y);
            other += found.status == expected.status ? 0 : 1;
            if (found.status != expected.status || found.status == 0) continue;
            ++rays;
            const double slope = std::hypot(expected.ray.slope_u, expected.ray.slope_v) / scene.relief_depth;
            // At the silhouette the entry moves by the root of what is rounded.
            const double near = 2e-6 * (1 + slope * slope);
            const auto apart = [](float a, float b) {
              const double way = std::abs(static_cast<double>(a) - static_cast<double>(b));
              return std::min(way, std::abs(way - 1));
            };
            EXPECT_LE(apart(found.ray.u, expected.ray.u), near) << surface_row(kind).id << " " << x << "," << y;
            EXPECT_LE(apart(found.ray.v, expected.ray.v), near) << surface_row(kind).id << " " << x << "," << y;
            EXPECT_NEAR(found.ray.slope_u, expected.ray.slope_u, near * (1 + slope));
            EXPECT_NEAR(found.ray.slope_v, expected.ray.slope_v, near * (1 + slope));
          }
        EXPECT_GT(rays, 100) << surface_row(kind).id;
        EXPECT_LE(other, 4) << surface_row(kind).id;
      }
  });
}

/// How a setting's frame is judged in a scene.
JudgedFrame judged_frame(const Rig& rig, const Settings& settings, const Heightfield& heights, const Scene& scene) {
  const StoredMap map = store_map(settings, heights, scene.wrap);
  const std::vector<ScorePixel> pixels = trace_frame(rig, settings, map, scene);
  const FrameUniforms frame = frame_uniforms(scene, heights.width, heights.height);
  return judge(frame, scene.wrap, false, pixels,
               exact_hits(ReferenceTracer(map.surface, scene.wrap), frame, scene.wrap, pixels));
}

std::vector<Settings> with_every_silhouette(const Technique& technique, const Scene& scene) {
  std::vector<Settings> list;
  const Settings plain(technique);
  if (conflict(plain, scene, technique.is_of_solids()).empty()) list.push_back(plain);
  if (technique.find("silhouette") == nullptr) return list;
  for (const char* row : {"clip", "quadric", "quadric_exact"}) {
    Settings settings(technique);
    settings.set("silhouette", row);
    if (conflict(settings, scene, technique.is_of_solids()).empty()) list.push_back(settings);
  }
  return list;
}

TEST_P(SurfaceTest, every_technique_and_silhouette_draws_the_top_plate) {
  on_every_device([](const Rig& rig) {
    std::size_t number = 0;
    for (const SurfaceKind kind : kCurved)
      for (const Technique& technique : techniques()) {
        if (technique.id == "depth_slices") continue;  // no slice is the top plate
        const Scene scene = curved_scene(kind, 0.08, Wrap::clamp, 32);
        for (const Settings& settings : with_every_silhouette(technique, scene)) {
          if (!is_tried_here(rig, number++)) continue;
          const JudgedFrame frame = judged_frame(rig, settings, level_map(1, 32), scene);
          EXPECT_GT(frame.score.pixels, 50) << settings.text();
          EXPECT_EQ(frame.score.at("false_kill_rate"), 0) << surface_row(kind).id << technique.id << settings.text();
          EXPECT_LE(frame.score.at("false_keep_rate"), 0.01) << surface_row(kind).id << technique.id << settings.text();
          EXPECT_LE(frame.score.at("e_xy.max"), 0.05) << surface_row(kind).id << technique.id << settings.text();
        }
      }
  });
}

TEST_P(SurfaceTest, a_quadric_finds_the_silhouette_of_a_smaller_surface) {
  on_every_device([](const Rig& rig) {
    std::size_t number = 0;
    for (const Technique& technique : techniques())
      for (const SurfaceKind kind : {SurfaceKind::cylinder, SurfaceKind::sphere}) {
        if (!is_tried_here(rig, number++ / 2 + (kind == SurfaceKind::sphere ? 1 : 0))) continue;
        const Scene scene = curved_scene(kind, 0.12, Wrap::repeat, 64);
        double kept_without = 0;
        for (const Settings& settings : with_every_silhouette(technique, scene)) {
          const JudgedFrame frame = judged_frame(rig, settings, level_map(0.25F, 32), scene);
          const double kept = frame.score.at("false_keep_rate");
          if (settings.is("silhouette", "quadric")) {
            EXPECT_LE(kept, 0.3 * kept_without) << surface_row(kind).id << technique.id << settings.text();
            EXPECT_LE(frame.score.at("false_kill_rate"), 0.02) << technique.id << settings.text();
          } else if (frame_features(settings).empty()) {
            EXPECT_GT(kept, 0.04) << surface_row(kind).id << technique.id;
            kept_without = kept;
            EXPECT_EQ(frame.score.at("false_kill_rate"), 0) << technique.id;
          }
        }
      }
  });
}

/// Least and last height of a bent ray over the surface, and the end of its way.
struct BentWay {
  double least = 1;
  double at_hit = 0;
};
BentWay bent_way(const Heightfield& surface, Wrap wrap, const TextureRay& ray, double bend, double t_end) {
  constexpr int kSamples = 4000;
  BentWay way;
  for (int i = 0; i <= kSamples; ++i) {
    const double t = t_end * i / kSamples;
    const double gap = gap_above(surface, wrap, ray, t) + bend * t * t;
    if (i < kSamples) way.least = std::min(way.least, gap);
    way.at_hit = gap;
  }
  return way;
}

// What is promised of straight rays holds of bent ones: nothing is stepped over, and exact ones end on the surface.
TEST_P(SurfaceTest, bent_rays_keep_what_straight_ones_promise) {
  on_every_device([](const Rig& rig) {
    int checked = 0;
    for (const SurfaceKind kind : kCurved)
      for (const char* setting :
           {"cone?cone_steps=2000&format=rg32f&encoding=ratio&filter=manual&silhouette=quadric",
            "cone?cone_steps=2000&step=plain&format=rg32f&encoding=ratio&filter=manual&silhouette=quadric",
            "cone?cone_steps=2000&format=rg32f&encoding=ratio&filter=manual&silhouette=quadric&refinement=binary",
            "quad_cone?cone_steps=2000&filter=manual&silhouette=quadric",
            "max_mip?node_steps=2000&format=r32f&silhouette=quadric",
            "distance?sphere_steps=2000&format=r32f&silhouette=quadric"})
        for (const char* source : {"fbm", "spikes", "checker"}) {
          const Settings settings = parse_setting(setting);
          const Guarantee guarantee = guarantee_of(settings);
          ASSERT_NE(guarantee, Guarantee::none) << setting;
          Scene scene = curved_scene(kind, kind == SurfaceKind::torus ? 0.12 : 0.3, Wrap::repeat, 28);
          const StoredMap map =
              store_map(settings, load_heightmap({.source = source, .width = 32, .height = 32}), scene.wrap);
          const std::vector<ScorePixel> pixels = trace_frame(rig, settings, map, scene);
          const FrameUniforms frame = frame_uniforms(scene, 32, 32);
          const SurfaceShape shape(frame);
          for (std::size_t i = 0; i < pixels.size(); ++i) {
            const ScorePixel& pixel = pixels[i];
            if (pixel.status == static_cast<float>(PixelStatus::no_ray)) continue;
            const SurfaceRay ray =
                surface_ray(frame, shape, scene.wrap, static_cast<int>(i % 28), static_cast<int>(i / 28));
            if (!ray.enters) continue;
            const BentWay way = bent_way(map.surface, scene.wrap, pixel.ray, ray.bend, pixel.t);
            const double travel = 32 * std::hypot(pixel.ray.slope_u, pixel.ray.slope_v) * pixel.t;
            const double bent = pixel.t * pixel.t;
            // Where a ray grazes, floats tell little of its bend.
            const double of_bend = ray.cosine < 0.02 ? ray.bend_blur * bent : 0;
            const double blur = 1e-5 * (1 + travel + std::abs(ray.bend) * bent) + of_bend;
            ASSERT_GE(way.least, -blur) << surface_row(kind).id << " " << setting << " " << source << " pixel " << i;
            ++checked;
            if (guarantee == Guarantee::exact && pixel.status == static_cast<float>(PixelStatus::hit)) {
              ASSERT_LE(std::abs(way.at_hit), blur) << surface_row(kind).id << " " << setting << " " << source;
            }
            ASSERT_TRUE(guarantee != Guarantee::exact || pixel.status != static_cast<float>(PixelStatus::step_cap))
                << surface_row(kind).id << " " << setting << " " << source << " pixel " << i << " t " << pixel.t;
          }
        }
    EXPECT_GT(checked, 5000);
  });
}

// A surface so large is a plane: an error of many tiles on it is that of the plane, and was less than half a tile once.
TEST_P(SurfaceTest, errors_of_whole_tiles_count) {
  on_every_device([](const Rig& rig) {
    Scene scene = kScene;
    scene.tiling = 20;
    scene.relief_depth = 2;
    const auto error = [&] {
      return judged_frame(rig, parse_setting("flat"), small_fbm(), scene).score.at("e_xy.mean");
    };
    const double on_plane = error();
    EXPECT_GT(on_plane, 23) << "half a tile along both axes";
    for (const SurfaceKind kind : {SurfaceKind::cylinder, SurfaceKind::sphere}) {
      scene.surface = {.kind = kind, .round = 4000};
      EXPECT_NEAR(error(), on_plane, 0.02 * on_plane) << surface_row(kind).id;
    }
  });
}

// The relief of a sphere is what its quadric makes of it, near enough to the exact one; the tangent plane is not.
TEST_P(SurfaceTest, a_quadric_is_nearer_to_the_exact_surface_than_the_plane) {
  on_every_device([](const Rig& rig) {
    const Scene scene = curved_scene(SurfaceKind::sphere, 0.12, Wrap::repeat, 64);
    const auto score = [&](const char* silhouette) {
      const Settings settings = settings_of("max_mip", {{"format", "r32f"}, {"silhouette", silhouette}});
      return judged_frame(rig, settings, small_fbm(), scene).score;
    };
    const FrameScore plane = score("none");
    const FrameScore quadric = score("quadric");
    EXPECT_LT(quadric.at("e_xy.mean"), 0.7 * plane.at("e_xy.mean"));
    EXPECT_LT(quadric.at("false_keep_rate"), 0.2 * plane.at("false_keep_rate"));
  });
}

}  // namespace
}  // namespace reliefbench
