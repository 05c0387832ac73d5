// Curved surfaces: their exact reference against analytic cases and a slow independent march, the shaders' rays against
// the C++ twin, every technique and silhouette on both backends.
#include "kernels/trace/surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/trace/guarantee.h"
#include "kernels/trace/surface_tracer.h"
#include "tests/slow_surface.h"
#include "tests/technique_rig.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

constexpr std::array kCurved{SurfaceKind::cylinder, SurfaceKind::sphere, SurfaceKind::torus};

Heightfield constant_map(float height, int side = 16) {
  return {.width = side, .height = side, .texels = std::vector<float>(static_cast<std::size_t>(side * side), height)};
}

Scene curved_scene(SurfaceKind kind, double relief_depth = 0.08, Wrap wrap = Wrap::repeat, int side_px = 48) {
  return {.view = {.id = "whole", .elevation_deg = 35, .distance = 2.6, .fov_deg = 40, .azimuth_deg = 20},
          .relief_depth = relief_depth,
          .wrap = wrap,
          .width_px = side_px,
          .height_px = side_px,
          .surface = {.kind = kind}};
}

/// Calls use(ray, x, y) for the pixels whose rays enter.
template <typename Use>
int each_ray(const Scene& scene, int map_side, const Use& use) {
  const FrameUniforms frame = frame_uniforms(scene, map_side, map_side);
  const SurfaceShape shape(frame);
  int count = 0;
  for (int y = 0; y < scene.height_px; ++y)
    for (int x = 0; x < scene.width_px; ++x) {
      const SurfaceRay ray = surface_ray(frame, shape, scene.wrap, x, y);
      if (!ray.enters) continue;
      use(shape, ray);
      ++count;
    }
  return count;
}

/// The way to where a straight line first meets a surface of the same kind whose tube is narrower: its top plate.
double way_to_inner(SurfaceShape shape, const SurfaceRay& ray, double height) {
  const double depth = (1 - height) * shape.relief;
  // The same middle, so that the apex is lower.
  Point3 from = ray.from;
  from[2] += depth;
  shape.tube -= depth;
  return shape.enter(from, ray.direction);
}

// An eye a rounding beside its place sees other rays: by no more than their blur, and not by nothing to speak of.
TEST(SurfaceTracer, the_blur_of_a_ray_bounds_what_a_rounding_of_the_eye_makes) {
  for (const SurfaceKind kind : kCurved) {
    Scene scene = curved_scene(kind, 0.1, Wrap::repeat, 32);
    const FrameUniforms frame = frame_uniforms(scene, 32, 32);
    const SurfaceShape shape(frame);
    double most = 0;
    int checked = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const float away : {-100.0F, 100.0F}) {
        FrameUniforms moved = frame;
        moved.position.at(axis) = std::nextafter(frame.position.at(axis), away);
        for (int i = 0; i < 32 * 32; ++i) {
          const SurfaceRay ray = surface_ray(frame, shape, scene.wrap, i % 32, i / 32);
          if (!ray.enters || !std::isfinite(ray.way_blur)) continue;
          const SurfaceRay other = surface_ray(moved, shape, scene.wrap, i % 32, i / 32);
          ASSERT_TRUE(other.enters) << i;
          ASSERT_LE(std::abs(other.way - ray.way), ray.way_blur) << i;
          ASSERT_LE(std::abs(other.cosine - ray.cosine), ray.cosine_blur) << i;
          ASSERT_LE(std::abs(other.bend - ray.bend), ray.bend_blur) << i;
          if (ray.cosine > 0.5) {
            ASSERT_LT(ray.cosine_blur, 1e-4) << i;
            ASSERT_LT(ray.bend_blur, 1e-3) << i;
          }
          most = std::max(most, std::abs(other.cosine - ray.cosine) / ray.cosine_blur);
          ++checked;
        }
      }
    EXPECT_GT(checked, 1000) << surface_row(kind).id;
    EXPECT_GT(most, 0.005) << surface_row(kind).id;
  }
}

TEST(SurfaceTracer, a_full_height_is_the_top_plate) {
  for (const SurfaceKind kind : kCurved) {
    const ReferenceTracer tracer(constant_map(1), Wrap::repeat);
    const int rays = each_ray(curved_scene(kind), 16, [&](const SurfaceShape& shape, const SurfaceRay& ray) {
      const ReferenceHit hit = trace_surface(tracer, shape, ray, Wrap::repeat);
      ASSERT_NEAR(hit.t_enter * ray.per_t, 0, 1e-9) << surface_row(kind).id;
    });
    EXPECT_GT(rays, 100);
  }
}

TEST(SurfaceTracer, a_constant_height_is_a_smaller_surface_of_its_kind) {
  for (const SurfaceKind kind : kCurved)
    for (const double height : {0.0, 0.25, 0.75}) {
      const ReferenceTracer tracer(constant_map(static_cast<float>(height)), Wrap::repeat);
      int passed = 0;
      each_ray(curved_scene(kind), 16, [&](const SurfaceShape& shape, const SurfaceRay& ray) {
        const ReferenceHit hit = trace_surface(tracer, shape, ray, Wrap::repeat);
        double inner = way_to_inner(shape, ray, height);
        // A ring's far side is seen past its near one: another fragment's.
        const bool is_behind =
            kind == SurfaceKind::torus && inner >= 0 && hit.passes() && inner > ray.way + 2 * shape.tube;
        if (is_behind) inner = -1;
        ASSERT_EQ(hit.passes(), inner < 0) << surface_row(kind).id << " " << height;
        passed += hit.passes() ? 1 : 0;
        if (hit.passes()) return;
        ASSERT_NEAR(ray.way + hit.t_enter * ray.per_t, inner, 1e-8) << surface_row(kind).id;
      });
      EXPECT_GT(passed, 10) << surface_row(kind).id << " " << height;  // its silhouette is inside the top plate's
    }
}

TEST(SurfaceTracer, agrees_with_a_slow_march_and_never_skips) {
  int passed = 0;
  int found_more = 0;
  int rays = 0;
  for (const SurfaceKind kind : kCurved)
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
      for (const char* source : {"fbm", "spikes", "cliff"}) {
        const Heightfield map = load_heightmap({.source = source, .width = 16, .height = 16});
        const ReferenceTracer tracer(map, wrap);
        Scene scene = curved_scene(kind, kind == SurfaceKind::torus ? 0.12 : 0.2, wrap, 20);
        scene.view.distance = 1.8;
        rays += each_ray(scene, 16, [&](const SurfaceShape& shape, const SurfaceRay& ray) {
          const SlowSurface slow(map, shape, wrap);
          const ReferenceHit hit = trace_surface(tracer, shape, ray, wrap);
          const auto expected = static_cast<double>(slow.first_hit(ray));
          const double way = ray.way + hit.t_enter * ray.per_t;
          passed += hit.passes() ? 1 : 0;
          if (hit.passes() && expected < 0) return;
          if (!hit.passes() && expected >= 0 && std::abs(way - expected) <= 1e-8) return;
          // Nothing but an earlier touch that the march stepped over.
          ASSERT_FALSE(hit.passes()) << surface_row(kind).id << " " << source << ": " << expected;
          ASSERT_TRUE(expected < 0 || way < expected) << surface_row(kind).id << " " << source << " " << way - expected;
          ASSERT_NEAR(static_cast<double>(slow.at(ray, way).gap), 0, 1e-7) << surface_row(kind).id << " " << source;
          ++found_more;
        });
      }
  EXPECT_GT(rays, 2000);
  EXPECT_GT(passed, 20);
  EXPECT_LT(found_more, rays / 100);
}

TEST(SurfaceTracer, leaves_the_solid_where_it_ends) {
  const Heightfield map = load_heightmap({.source = "spikes", .width = 16, .height = 16});
  const ReferenceTracer tracer(map, Wrap::repeat);
  int ended = 0;
  each_ray(curved_scene(SurfaceKind::sphere, 0.2), 16, [&](const SurfaceShape& shape, const SurfaceRay& ray) {
    const ReferenceHit hit = trace_surface(tracer, shape, ray, Wrap::repeat);
    if (hit.passes() || !(hit.t_exit < 1e300)) return;
    ++ended;
    const SlowSurface slow(map, shape, Wrap::repeat);
    ASSERT_GE(hit.t_exit, hit.t_enter);
    ASSERT_NEAR(static_cast<double>(slow.at(ray, ray.way + hit.t_exit * ray.per_t).gap), 0, 1e-7);
    const double middle = 0.5 * (hit.t_enter + hit.t_exit);
    ASSERT_LE(static_cast<double>(slow.at(ray, ray.way + middle * ray.per_t).gap), 1e-9);
  });
  EXPECT_GT(ended, 20);
}

// Spheres of such a ray would come no nearer in thousands of steps.
TEST(SurfaceTracer, a_ray_that_grazes_a_torus_enters_it) {
  const FrameUniforms frame = frame_uniforms(curved_scene(SurfaceKind::torus), 16, 16);
  const SurfaceShape shape(frame);
  for (const double turn : {-0.3, 0.0, 0.4})
    for (const double heading : {0.0, 0.7, 1.5})
      for (const double cosine : {0.3, 1e-2, 3e-3, 1e-3, 1e-4, 1e-5}) {
        // On the outside, round the axis by `turn`: where the torus is convex, what is met first is the point itself.
        const double outer = shape.ring + shape.tube;
        const Point3 at{0.5 + outer * std::sin(turn), 0.5, outer * (std::cos(turn) - 1)};
        const SurfacePlace place = shape.place_of(at);
        const double level = std::sqrt(1 - cosine * cosine);
        Point3 direction{};
        Point3 from{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          direction.at(axis) =
              level * (std::cos(heading) * place.tangent_u.at(axis) + std::sin(heading) * place.tangent_v.at(axis)) -
              cosine * place.normal.at(axis);
          from.at(axis) = at.at(axis) - 2 * direction.at(axis);
        }
        // A distance that is off by 1e-13 is one that is off by that over the cosine, along the ray.
        EXPECT_NEAR(shape.enter(from, direction), 2, 1e-12 / cosine) << turn << " " << heading << " " << cosine;
      }
}

// Its inside is thousands of reliefs wide.
TEST(SurfaceTracer, leaves_a_large_sphere_on_its_far_side) {
  Scene scene = curved_scene(SurfaceKind::sphere, 0.01);
  scene.surface.round = 200;
  const ReferenceTracer tracer(constant_map(0.5F), Wrap::repeat);
  int ended = 0;
  each_ray(scene, 16, [&](const SurfaceShape& shape, const SurfaceRay& ray) {
    const ReferenceHit hit = trace_surface(tracer, shape, ray, Wrap::repeat);
    if (hit.passes() || !(hit.t_exit < 1e300)) return;
    ++ended;
    const double beyond = ray.way + 4 * shape.tube;
    SurfaceRay back = ray;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      back.from.at(axis) += beyond * ray.direction.at(axis);
      back.direction.at(axis) = -ray.direction.at(axis);
    }
    ASSERT_NEAR(ray.way + hit.t_exit * ray.per_t, beyond - way_to_inner(shape, back, 0.5), 1e-7);
  });
  EXPECT_GT(ended, 100);
}

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
          const JudgedFrame frame = judged_frame(rig, settings, constant_map(1, 32), scene);
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
          const JudgedFrame frame = judged_frame(rig, settings, constant_map(0.25F, 32), scene);
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
            if (!ray.enters || ray.cosine < 0.02) continue;  // floats tell too little of the bend there
            const BentWay way = bent_way(map.surface, scene.wrap, pixel.ray, ray.bend, pixel.t);
            const double travel = 32 * std::hypot(pixel.ray.slope_u, pixel.ray.slope_v) * pixel.t;
            const double blur = 1e-5 * (1 + travel + std::abs(ray.bend) * pixel.t * pixel.t);
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
