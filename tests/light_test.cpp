// The exact reference of self-shadow.
#include "kernels/judge/light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/image/heightmap.h"

namespace reliefbench {
namespace {

Heightfield field_of(int width, int height, const auto& at) {
  Heightfield map{.width = width, .height = height, .texels = {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) map.texels.push_back(static_cast<float>(at(x, y)));
  return map;
}

/// A wall of a height along v, from texel 8 to 15 of 64.
Heightfield wall(double height) {
  return field_of(64, 8, [=](int x, int) { return x >= 8 && x < 16 ? height : 0.0; });
}

/// From the middle of texel 15, which is the wall's last.
double texels_off(double texels) { return (15.5 + texels) / 64; }

TEST(ExactLight, ends_where_a_walls_shadow_does) {
  for (const double height : {0.25, 1.0})
    for (const double slope : {0.07, 0.1, 0.4}) {  // uv per unit of height: depth / tan(elevation)
      const ReferenceTracer tracer(wall(height), Wrap::clamp);
      const double shadow_texels = 64 * height * slope;  // from the wall's edge, on the ground
      for (const double v : {0.1, 0.5 / 8, 0.9}) {
        SCOPED_TRACE(testing::Message() << height << " " << slope << " " << v);
        const auto is_lit = [&](double texels) {
          return tracer.is_lit({.u = texels_off(texels), .v = v, .slope_u = -slope, .slope_v = 0});
        };
        EXPECT_FALSE(is_lit(shadow_texels - 1e-9));
        EXPECT_TRUE(is_lit(shadow_texels + 1e-9));
        if (shadow_texels > 2) {
          EXPECT_FALSE(is_lit(1.5));
        }
        EXPECT_TRUE(is_lit(-1));                                                                     // on the wall
        EXPECT_TRUE(is_lit(shadow_texels + 5));                                                      // and far from it
        EXPECT_TRUE(tracer.is_lit({.u = texels_off(1.5), .v = v, .slope_u = slope, .slope_v = 0}));  // away from it
      }
    }
}

TEST(ExactLight, goes_round_a_tile_and_stops_at_a_clamped_edge) {
  // Behind the map's right edge the wall of the next tile begins.
  const RisingRay ray{.u = 0.95, .v = 0.5, .slope_u = 0.4, .slope_v = 0};
  EXPECT_FALSE(ReferenceTracer(wall(1), Wrap::repeat).is_lit(ray));
  EXPECT_TRUE(ReferenceTracer(wall(1), Wrap::clamp).is_lit(ray));
}

TEST(ExactLight, needs_no_bias_on_planes_at_texels_and_on_borders) {
  const Heightfield flat = field_of(16, 16, [](int, int) { return 0.625; });
  const Heightfield ramp = field_of(16, 16, [](int x, int) { return x / 16.0; });
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
    for (int x = 0; x <= 32; ++x)
      for (int y = 0; y <= 32; ++y)
        for (const double slope : {-50.0, -0.3, 0.0, 0.3, 50.0}) {
          const double u = x / 32.0;  // texel centres and the middles between them
          const double v = y / 32.0;
          EXPECT_TRUE(ReferenceTracer(flat, wrap).is_lit({.u = u, .v = v, .slope_u = slope, .slope_v = slope / 3}));
        }
  // Along the ramp itself: 16 texels of 1/16 each are one unit of uv. It only touches.
  const ReferenceTracer tracer(ramp, Wrap::clamp);
  EXPECT_TRUE(tracer.is_lit({.u = 0.2, .v = 0.5, .slope_u = 1, .slope_v = 0}));
  EXPECT_FALSE(tracer.is_lit({.u = 0.2, .v = 0.5, .slope_u = 1.0001, .slope_v = 0}));
}

TEST(ExactLight, straight_up_is_lit_and_what_is_not_finite_is_not) {
  const ReferenceTracer tracer(load_heightmap({.source = "spikes", .width = 32, .height = 32}), Wrap::repeat);
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(tracer.is_lit({.u = i / 37.0, .v = i / 19.0}));
  EXPECT_FALSE(tracer.is_lit({.u = 0.3, .v = 0.3, .slope_u = 1e300, .slope_v = 0}));
  EXPECT_FALSE(tracer.is_lit({.u = 0.3, .v = 0.3, .slope_u = std::nan(""), .slope_v = 0}));
}

/// The surface by its definition: weights of the four texels.
double height_at(const Heightfield& map, Wrap wrap, double u, double v) {
  const double x = u * map.width - 0.5;
  const double y = v * map.height - 0.5;
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  double height = 0;
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx)
      height += std::abs(1 - dx - (x - i)) * std::abs(1 - dy - (y - j)) *
                static_cast<double>(map.at(wrapped(i + dx, map.width, wrap), wrapped(j + dy, map.height, wrap)));
  return height;
}

// A fine march in double: a point under the surface is dark for certain, and so is it lit where no point comes nearer
// to the surface than a step can lead.
TEST(ExactLight, agrees_with_a_fine_march) {
  constexpr int kSteps = 4000;
  std::mt19937 random(7);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  int lit = 0;
  int dark = 0;
  int open = 0;
  for (const char* source : {"fbm", "bricks", "spikes", "checker", "pyramids"})
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      const Heightfield map = load_heightmap({.source = source, .width = 23, .height = 16});
      const ReferenceTracer tracer(map, wrap);
      for (int i = 0; i < 150; ++i) {
        const double steepness = std::exp(uniform(std::log(0.01), std::log(3)));
        const double angle = uniform(0, 6.28318);
        const RisingRay ray{.u = uniform(0, 1),
                            .v = uniform(0, 1),
                            .slope_u = steepness * std::cos(angle),
                            .slope_v = steepness * std::sin(angle)};
        const double z = height_at(map, wrap, ray.u, ray.v);
        const double top = 1 - z;
        double nearest = 1;
        for (int k = 1; k <= kSteps; ++k) {
          const double s = top * k / kSteps;
          nearest = std::min(nearest, z + s - height_at(map, wrap, ray.u + ray.slope_u * s, ray.v + ray.slope_v * s));
        }
        // The surface rises by at most one a texel along either axis.
        const double reach = top / kSteps * (1 + std::abs(ray.slope_u) * 23 + std::abs(ray.slope_v) * 16);
        const bool is_lit = tracer.is_lit(ray);
        if (nearest < -1e-9) {
          EXPECT_FALSE(is_lit) << source << i;
          ++dark;
        } else if (nearest > reach) {
          EXPECT_TRUE(is_lit) << source << i;
          ++lit;
        } else {
          ++open;  // most of these begin along the surface
          lit += is_lit ? 1 : 0;
          if (!is_lit) {  // then a finer march near the start finds a point under it
            double lowest = 1;
            for (int k = 1; k <= 200 * kSteps && lowest >= -1e-12; ++k) {
              const double s = top * k / (200.0 * kSteps);
              lowest = std::min(lowest, z + s - height_at(map, wrap, ray.u + ray.slope_u * s, ray.v + ray.slope_v * s));
            }
            EXPECT_LT(lowest, 0) << source << i;
          }
        }
      }
    }
  EXPECT_GT(lit, 200);
  EXPECT_GT(dark, 200);
}

LightSource disc(double elevation_deg, double radius) {
  const double angle = elevation_deg * 3.14159265358979 / 180;
  return {.direction = {-std::cos(angle), 0, std::sin(angle)}, .radius = radius, .relief_depth = 0.1};
}

float share_at(const Heightfield& map, const LightSource& light, double u) {
  const ReferenceTracer tracer(map, Wrap::clamp);
  const TextureRay ray{.u = static_cast<float>(u), .v = 0.5F};
  const ReferenceHit hit = tracer.trace(ray);
  return exact_light(tracer, light, {&ray, 1}, {&hit, 1}).front();
}

TEST(ExactLight, of_a_disc_is_the_share_of_its_directions) {
  const double elevation_deg = 30;
  const double at = texels_off(64 * 0.1 / std::tan(elevation_deg * 3.14159265358979 / 180));  // the shadow's edge
  EXPECT_EQ(light_rays(disc(elevation_deg, 0.1), 0, 0).size(), 64U);
  EXPECT_EQ(light_rays(disc(elevation_deg, 0), 0, 0).size(), 1U);
  // Half of the disc is over the wall's edge, seen from the edge of the point's shadow.
  EXPECT_NEAR(static_cast<double>(share_at(wall(1), disc(elevation_deg, 0.1), at)), 0.5, 1.0 / 16);
  float before = -1;
  for (int i = -40; i <= 40; ++i) {
    const float share = share_at(wall(1), disc(elevation_deg, 0.1), at + i / 640.0);
    EXPECT_GE(share, before) << i;
    before = share;
  }
  EXPECT_EQ(before, 1);
  EXPECT_EQ(share_at(wall(1), disc(elevation_deg, 0.1), texels_off(2)), 0);
  EXPECT_EQ(share_at(wall(1), disc(elevation_deg, 0), texels_off(2)), 0);
}

TEST(ExactLight, comes_only_from_over_the_horizon) {
  const Heightfield flat = field_of(8, 8, [](int, int) { return 0.5; });
  EXPECT_EQ(share_at(flat, disc(-5, 0), 0.5), 0);
  EXPECT_EQ(share_at(flat, disc(0, 0), 0.5), 0);
  EXPECT_EQ(share_at(flat, disc(5, 0), 0.5), 1);
  EXPECT_EQ(share_at(flat, disc(90, 0.2), 0.5), 1);
  EXPECT_NEAR(static_cast<double>(share_at(flat, disc(0, 0.2), 0.5)), 0.5, 1.0 / 16);  // the upper half of the sun
  EXPECT_EQ(share_at(flat, disc(-20, 0.2), 0.5), 0);
}

}  // namespace
}  // namespace reliefbench
