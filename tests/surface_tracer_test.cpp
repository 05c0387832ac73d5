// The exact reference of curved surfaces against analytic cases and a slow independent march.
#include "kernels/trace/surface_tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/image/heightmap.h"
#include "tests/curved_scene.h"
#include "tests/slow_surface.h"

namespace reliefbench {
namespace {

/// Calls use(shape, ray) for the pixels whose rays enter.
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
    const ReferenceTracer tracer(level_map(1), Wrap::repeat);
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
      const ReferenceTracer tracer(level_map(static_cast<float>(height)), Wrap::repeat);
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
  const ReferenceTracer tracer(level_map(0.5F), Wrap::repeat);
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

}  // namespace
}  // namespace reliefbench
