// Omni-directional displacement: the table against a slow march and its own rays, and what the lookups make of it.
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstring>
#include <set>

#include "kernels/base/error.h"
#include "kernels/image/heightmap.h"
#include "kernels/judge/score.h"
#include "kernels/maps/map_verify.h"
#include "kernels/maps/omni_table.h"
#include "tests/cone_test_maps.h"
#include "tests/slow_cone_map.h"
#include "tests/technique_rig.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

constexpr std::array<std::string_view, 6> kIds{"omni_x", "omni_y", "omni_a", "omni_b", "omni_order", "omni_directions"};

std::vector<MapValue> table_values(const std::array<int, 6>& values) {
  std::vector<MapValue> list;
  for (std::size_t i = 0; i < kIds.size(); ++i) list.push_back({.param = kIds.at(i), .value = values.at(i)});
  return list;
}

std::vector<MapValue> any_table() {
  return table_values({*rc::gen::inRange(2, 8), *rc::gen::inRange(2, 8), *rc::gen::inRange(2, 7),
                       *rc::gen::inRange(2, 7), *rc::gen::inRange(0, 2), *rc::gen::inRange(0, 2)});
}

Heightfield any_relief() { return noise_map(*rc::gen::inRange(2, 9), *rc::gen::inRange(2, 9)); }

/// The shader's coordinates of a direction, in double.
std::pair<double, double> coordinates(const OmniTable& table, double s, double t) {
  constexpr double kPi = 3.14159265358979323846;
  if (!table.is_octahedral)
    return {std::acos(s / std::sqrt(s * s + 1)) / kPi, std::acos(t / std::sqrt(s * s + t * t + 1)) / kPi};
  const double sum = std::abs(s) + std::abs(t) + 1;
  return {0.5 + 0.5 * (s + t) / sum, 0.5 + 0.5 * (s - t) / sum};
}

// Every texel is one node's, and the ray of a node has the node's own coordinates.
RC_GTEST_PROP(Omni, texels_and_rays_are_one_to_one, ()) {
  const OmniTable table(any_table());
  std::set<std::array<int, 4>> nodes;
  for (int row = 0; row < table.height(); ++row)
    for (int column = 0; column < table.width(); ++column) {
      const OmniTable::Node node = table.node_at(column, row);
      nodes.insert({node.x, node.y, node.a, node.b});
      const TextureRay ray = table.ray(node);
      RC_ASSERT(ray.u == static_cast<float>((node.x + 0.5) / table.x));
      RC_ASSERT(ray.v == static_cast<float>((node.y + 0.5) / table.y));
      constexpr auto kTile = static_cast<double>(kOmniTile);
      const auto [a, b] =
          coordinates(table, static_cast<double>(ray.slope_u) * kTile, static_cast<double>(ray.slope_v) * kTile);
      RC_ASSERT(std::abs(a * table.a - (node.a + 0.5)) < 1e-5);
      RC_ASSERT(std::abs(b * table.b - (node.b + 0.5)) < 1e-5);
    }
  RC_ASSERT(nodes.size() == static_cast<std::size_t>(table.x * table.y * table.a * table.b));
  const auto [x, y, a, b] = *nodes.rbegin();
  RC_ASSERT(x == table.x - 1 && y == table.y - 1 && a == table.a - 1 && b == table.b - 1);
}

// What the documentation says of the directions: none is farther from the nearest of n x n than these angles.
TEST(Omni, directions_lie_as_near_one_another_as_is_said) {
  for (const bool octahedral : {true, false})
    for (const int n : {4, 8, 16, 32}) {
      const OmniTable table(table_values({2, 2, n, n, 0, octahedral ? 0 : 1}));
      double worst = 0;
      for (int i = 0; i < 90; ++i)
        for (int j = 0; j < 360; ++j) {
          const double theta = (i + 0.5) / 90 * M_PI / 2;
          const double phi = (j + 0.5) / 360 * 2 * M_PI;
          const double s = std::tan(theta) * std::cos(phi);
          const double t = std::tan(theta) * std::sin(phi);
          const auto [a, b] = coordinates(table, s, t);
          const TextureRay ray = table.ray({.x = 0,
                                            .y = 0,
                                            .a = std::min(static_cast<int>(a * n), n - 1),
                                            .b = std::min(static_cast<int>(b * n), n - 1)});
          const double su = static_cast<double>(ray.slope_u) * static_cast<double>(kOmniTile);
          const double sv = static_cast<double>(ray.slope_v) * static_cast<double>(kOmniTile);
          const double cosine = (s * su + t * sv + 1) / std::sqrt((s * s + t * t + 1) * (su * su + sv * sv + 1));
          worst = std::max(worst, std::acos(std::min(cosine, 1.0)));
        }
      RecordProperty(fmt::format("{}_{}", octahedral ? "octahedral" : "spherical", n), fmt::format("{}", worst * n));
      EXPECT_LT(worst * n, octahedral ? 2.5 : 2.3) << n;
    }
}

/// The first hit by a march of many small steps.
double marched(const Heightfield& heights, Wrap wrap, const TextureRay& ray) {
  constexpr int kSteps = 20000;
  for (int i = 0; i <= kSteps; ++i) {
    const double t = static_cast<double>(i) / kSteps;
    const double u = static_cast<double>(ray.u) + static_cast<double>(ray.slope_u) * t;
    const double v = static_cast<double>(ray.v) + static_cast<double>(ray.slope_v) * t;
    if (1 - t <= slow_surface(heights, wrap, u * heights.width - 0.5, v * heights.height - 0.5)) return t;
  }
  return 1;
}

TEST(Omni, holds_what_a_fine_march_finds) {
  const Heightfield heights = fbm_map(12, 9);
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
    for (const int directions : {0, 1}) {
      const std::vector<MapValue> parameters = table_values({4, 3, 5, 4, 1, directions});
      const OmniTable table(parameters);
      const std::vector<float> values = bake_omni({.heights = heights, .wrap = wrap, .parameters = parameters});
      ASSERT_EQ(values.size(), 4U * 3 * 5 * 4);
      for (int row = 0; row < table.height(); ++row)
        for (int column = 0; column < table.width(); ++column) {
          const double found = values.at(static_cast<std::size_t>(row * table.width() + column));
          EXPECT_NEAR(found, marched(heights, wrap, table.ray(table.node_at(column, row))), 1.0 / 20000 + 1e-6);
        }
    }
}

TEST(Omni, is_the_same_on_any_number_of_threads) {
  const Heightfield heights = noise_map(9, 7);
  EXPECT_EQ(bake_omni({.heights = heights, .threads = 1}), bake_omni({.heights = heights, .threads = 2}));
}

MapTextures packed(const Heightfield& heights, std::span<const MapValue> parameters, const Format& format, Wrap wrap) {
  const std::vector<float> values =
      bake_omni({.heights = heights, .wrap = wrap, .parameters = {parameters.begin(), parameters.end()}, .threads = 1});
  return pack_map(
      {.map = find_map(MapKind::omni), .heights = heights, .values = values, .wrap = wrap, .parameters = parameters},
      format, find_encoding("ratio"));
}

RC_GTEST_PROP(Omni, verifies_as_it_is_stored_and_not_with_a_code_more, ()) {
  const std::vector<MapValue> parameters = any_table();
  const Format& format = find_format(*rc::gen::element<std::string_view>("r8", "r16", "r16f", "r32f"));
  const Wrap wrap = *rc::gen::element(Wrap::repeat, Wrap::clamp);
  MapTextures textures = packed(quantise_heights(any_relief(), format.type), parameters, format, wrap);
  const OmniTable table(parameters);
  RC_ASSERT(textures.extra->width == table.width());
  RC_ASSERT(textures.extra->height == table.height());
  const auto verdict = [&] {
    return verify_map({.map = find_map(MapKind::omni),
                       .textures = textures,
                       .format = format,
                       .encoding = find_encoding("ratio"),
                       .wrap = wrap,
                       .threads = 1,
                       .parameters = parameters});
  };
  const MapVerdict good = verdict();
  RC_ASSERT(good.table.values == table.width() * table.height());
  RC_ASSERT(good.table.wrong == 0);
  RC_ASSERT(!good.broken);
  // Any value, off by more than the format's step: all of the table's range here.
  const auto bytes = static_cast<std::size_t>(textures.extra->layout.bytes());
  const std::size_t texel = bytes * *rc::gen::inRange<std::size_t>(0, textures.extra->texels.size() / bytes);
  const float before = read_channel(*textures.extra, 0).at(texel / bytes);
  const std::uint32_t code = nearest_code(before > 0.5F ? before - 0.25F : before + 0.25F, format.type);
  std::memcpy(textures.extra->texels.data() + texel, &code, bytes);
  RC_ASSERT(verdict().table.wrong == 1);
  RC_ASSERT(verdict().broken);
}

TEST(Omni, tables_that_no_texture_holds_are_refused) {
  const auto refusal = [](const std::array<int, 6>& values) { return omni_refusal(table_values(values)); };
  EXPECT_EQ(refusal({256, 256, 64, 64, 0, 0}), "");  // 16384 texels a side
  EXPECT_EQ(refusal({257, 256, 64, 64, 0, 0}),
            "an omni table of 257 x 256 positions and 64 x 64 directions is a texture of 16448 x 16384 texels, "
            "expected at most 16384 a side");
  EXPECT_NE(refusal({256, 257, 64, 64, 1, 0}), "");
  EXPECT_THROW((void)bake_omni({.heights = noise_map(4, 4), .parameters = table_values({257, 2, 64, 2, 0, 0})}), Error);
  EXPECT_THROW((void)bake_omni({.heights = noise_map(4, 4), .parameters = {{"omni_a", 1}}}), Error);
  Settings settings = settings_of("omni", {{"omni_x", "2048"}});
  EXPECT_THAT(conflict(settings), HasSubstr("a texture of 32768 x 512 texels"));
  settings.set("omni_a", 8);
  EXPECT_EQ(conflict(settings), "");
}

TEST(Omni, memory_is_that_of_heights_and_table) {
  const Settings settings = settings_of("omni", {{"omni_x", "8"}, {"omni_y", "4"}, {"omni_a", "6"}, {"omni_b", "2"}});
  EXPECT_EQ(store_map(settings, small_fbm(), Wrap::repeat).textures.bytes(), 2U * (32 * 32 + 8 * 4 * 6 * 2));
}

using OmniOnDevices = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, OmniOnDevices, ::testing::Values("opengl", "vulkan"), backend_name);

Scene omni_scene(const View& view, Wrap wrap) { return {.view = view, .wrap = wrap, .width_px = 40, .height_px = 40}; }

// Between equal values there is nothing to interpolate, whichever way; the printed lookup is off, since it goes as far
// along the pixel's ray as the table's went along its own.
TEST_P(OmniOnDevices, a_flat_map_is_exact_unless_lengths_are_looked_up) {
  const Heightfield flat = constant_map(8, 8);
  on_every_device([&](const Rig& rig) {
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
      for (const std::string_view interpolation : {"none", "position", "direction", "both"})
        for (const std::string_view directions : {"octahedral", "spherical"}) {
          const Settings settings = settings_of(
              "omni", {{"interpolation", interpolation}, {"omni_directions", directions}, {"format", "r32f"}});
          const StoredMap map = store_map(settings, flat, wrap);
          for (const View& view : view_presets())
            for (const ScorePixel& pixel : trace_frame(rig, settings, map, omni_scene(view, wrap))) {
              if (static_cast<PixelStatus>(pixel.status) == PixelStatus::no_ray) continue;
              ASSERT_NEAR(pixel.t, 0.5, 1e-6) << settings.text() << " " << view.id;
            }
        }
    const Settings printed = settings_of("omni", {{"lookup", "published"}, {"omni_directions", "spherical"}});
    double worst = 0;
    for (const ScorePixel& pixel :
         trace_frame(rig, printed, store_map(printed, flat, Wrap::repeat), omni_scene(view_presets()[2], Wrap::repeat)))
      if (static_cast<PixelStatus>(pixel.status) == PixelStatus::hit)
        worst = std::max(worst, std::abs(static_cast<double>(pixel.t) - 0.5));
    EXPECT_GT(worst, 0.1);
  });
}

/// The middle of a frame that looks from far away along a ray of the table, to the plane's (u, v).
View view_along(const TextureRay& ray, double relief_depth) {
  const double per_height = std::hypot(ray.slope_u, ray.slope_v) / relief_depth;
  return {.id = "along a node",
          .elevation_deg = std::atan2(1.0, per_height) * 180 / M_PI,
          .distance = 1000,
          .fov_deg = 0.01,
          .azimuth_deg = std::atan2(-ray.slope_u, ray.slope_v) * 180 / M_PI};
}

// Along a direction of the table every pixel finds, to the bit, what the nearest position's own ray hits.
TEST_P(OmniOnDevices, is_exact_at_the_tables_own_rays) {
  on_every_device([](const Rig& rig) {
    for (const std::string_view order : kOmniOrders)
      for (const std::string_view directions : kOmniDirections)
        for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
          const Settings settings = settings_of("omni", {{"interpolation", "none"},
                                                         {"omni_x", "64"},
                                                         {"omni_y", "64"},
                                                         {"omni_a", "5"},
                                                         {"omni_b", "4"},
                                                         {"omni_order", order},
                                                         {"omni_directions", directions},
                                                         {"format", "r32f"}});
          const Heightfield ramp = make_map(8, 8, [](int x, int y) { return static_cast<float>(x + 2 * y) / 21.0F; });
          const StoredMap map = store_map(settings, ramp, wrap);
          const ReferenceTracer tracer(map.surface, wrap);
          const OmniTable table(map_values(settings));
          for (const OmniTable::Node node : {OmniTable::Node{.x = 0, .y = 0, .a = 1, .b = 2}, {0, 0, 3, 1}}) {
            const TextureRay own = table.ray(node);
            Scene scene = omni_scene(view_along(own, 0.1), wrap);
            for (const ScorePixel& pixel : trace_frame(rig, settings, map, scene)) {
              if (static_cast<PixelStatus>(pixel.status) == PixelStatus::no_ray) continue;
              ASSERT_NEAR(pixel.ray.slope_u, own.slope_u, 2e-4);
              ASSERT_NEAR(pixel.ray.slope_v, own.slope_v, 2e-4);
              const float u = (std::floor(pixel.ray.u * 64) + 0.5F) / 64;
              const float v = (std::floor(pixel.ray.v * 64) + 0.5F) / 64;
              const double expected =
                  tracer.first_hit({.u = u, .v = v, .slope_u = own.slope_u, .slope_v = own.slope_v});
              ASSERT_EQ(pixel.t, static_cast<float>(expected)) << settings.text();
            }
          }
        }
  });
}

TEST_P(OmniOnDevices, both_orders_have_the_same_bits) {
  on_every_device([](const Rig& rig) {
    for (const std::string_view interpolation : {"none", "position", "direction", "both"})
      for (const std::string_view directions : kOmniDirections)
        for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
          Settings settings = settings_of("omni", {{"interpolation", interpolation},
                                                   {"omni_x", "9"},
                                                   {"omni_y", "7"},
                                                   {"omni_a", "6"},
                                                   {"omni_b", "5"},
                                                   {"omni_directions", directions}});
          std::vector<std::vector<ScorePixel>> frames;
          for (const std::string_view order : kOmniOrders) {
            settings.set("omni_order", order);
            frames.push_back(trace_frame(rig, settings, store_map(settings, small_fbm(), wrap),
                                         omni_scene(view_presets()[1], wrap)));
          }
          for (std::size_t i = 0; i < frames[0].size(); ++i) ASSERT_EQ(frames[0][i].t, frames[1][i].t);
        }
  });
}

/// Mean e_z over the views.
double mean_error(const Rig& rig, const Settings& settings, const Heightfield& heights) {
  double sum = 0;
  const StoredMap map = store_map(settings, heights, Wrap::repeat);
  const ReferenceTracer tracer(map.surface, Wrap::repeat);
  for (const View& view : view_presets()) {
    const auto pixels = trace_frame(rig, settings, map, omni_scene(view, Wrap::repeat));
    sum += judge(pixels, exact_hits(tracer, pixels), heights.width, heights.height).score.at("e_z.mean");
  }
  return sum / static_cast<double>(view_presets().size());
}

// On a smooth relief every doubling of all sides brings the hits nearer; interpolation is nearer than the nearest
// entry, and the lookup as printed is the farthest.
TEST_P(OmniOnDevices, comes_nearer_with_every_size) {
  const Heightfield smooth = make_map(32, 32, [](int x, int y) {
    constexpr float kWave = 2 * 3.14159265F / 32;
    return 0.5F + 0.25F * (std::sin(kWave * static_cast<float>(x)) + std::cos(kWave * static_cast<float>(y)));
  });
  on_every_device([&](const Rig& rig) {
    for (const std::string_view directions : kOmniDirections) {
      double last = 1;
      for (const char* side : {"4", "8", "16", "32"}) {
        Settings settings = settings_of("omni", {{"omni_directions", directions}});
        for (const char* id : {"omni_x", "omni_y", "omni_a", "omni_b"}) settings.set(id, side);
        const double interpolated = mean_error(rig, settings, smooth);
        EXPECT_LT(interpolated, 0.75 * last) << settings.text();
        last = interpolated;
        settings.set("interpolation", "none");
        EXPECT_GT(mean_error(rig, settings, smooth), interpolated) << settings.text();
      }
      EXPECT_LT(last, 0.02) << directions;
    }
  });
}

// Vertical, level and flatter than any entry; far away and under clamp outside: always a hit between the plates.
TEST_P(OmniOnDevices, reads_are_defined_for_every_ray) {
  on_every_device([](const Rig& rig) {
    for (const auto& [lookup, filter] :
         {std::pair("fetched", "hardware"), {"published", "hardware"}, {"published", "manual"}})
      for (const std::string_view directions : kOmniDirections)
        for (const std::string_view order : kOmniOrders)
          for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
            Settings settings =
                settings_of("omni", {{"lookup", lookup}, {"omni_directions", directions}, {"omni_order", order}});
            settings.set("filter", filter);
            for (const char* id : {"omni_x", "omni_y", "omni_a", "omni_b"}) settings.set(id, 8);
            const StoredMap map = store_map(settings, small_fbm(), wrap);
            const auto pipeline = score_pipeline(rig, settings, wrap);
            for (const double elevation : {90.0, 1.0, 1e-5})
              for (const double azimuth : {0.0, 213.0})
                for (const double depth : {0.0, 0.1, 1e3}) {
                  Scene scene = omni_scene(
                      {.id = "any", .elevation_deg = elevation, .distance = 3, .fov_deg = 50, .azimuth_deg = azimuth},
                      wrap);
                  scene.relief_depth = depth;
                  scene.width_px = scene.height_px = 12;
                  for (const ScorePixel& pixel : trace_frame(rig, *pipeline, map, scene, &settings)) {
                    if (static_cast<PixelStatus>(pixel.status) == PixelStatus::no_ray) continue;
                    ASSERT_GE(pixel.t, 0) << settings.text() << " " << elevation << " " << azimuth;
                    ASSERT_LE(pixel.t, 1) << settings.text() << " " << elevation << " " << azimuth;
                  }
                }
          }
  });
}

}  // namespace
}  // namespace reliefbench
