// Levels of the map, fading to the plane, levels of normals, and pictures of 16 rays a pixel.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numeric>
#include <set>

#include "kernels/image/heightmap.h"
#include "kernels/maps/mip_chain.h"
#include "tests/technique_rig.h"
#include "tuner/measure/prepare.h"

namespace reliefbench {
namespace {

TEST(MeanLevels, are_means_of_what_a_texel_covers) {
  const Heightfield heights{.width = 5, .height = 2, .texels = {0, 1, 0, 1, 0.5F, 1, 0, 1, 0, 0.5F}};
  const std::vector<MipLevel> levels = mip_chain(heights, {}, 0, Wrap::repeat, Mips::mean);
  ASSERT_EQ(levels.size(), 2U);
  ASSERT_EQ(levels[0].heights.width, 2);  // each covers two and a half
  EXPECT_NEAR(levels[0].heights.texels[0], 0.5, 1e-6);
  EXPECT_NEAR(levels[0].heights.texels[1], 0.5, 1e-6);
  EXPECT_NEAR(levels[1].heights.texels[0], 0.5, 1e-6);
  const auto mean = [](const Heightfield& field) {
    return std::accumulate(field.texels.begin(), field.texels.end(), 0.0) / static_cast<double>(field.texels.size());
  };
  for (const MipLevel& level : mip_chain(small_fbm(), {}, 0, Wrap::clamp, Mips::mean))
    EXPECT_NEAR(mean(level.heights), mean(small_fbm()), 1e-5);
}

TEST(NormalLevels, go_down_to_one_texel) {
  std::vector<std::uint8_t> rgba8;
  for (int i = 0; i < 3 * 2; ++i) rgba8.insert(rgba8.end(), {static_cast<std::uint8_t>(30 * i), 100, 200, 255});
  EXPECT_EQ(append_levels(rgba8, 3, 2), 2);
  ASSERT_EQ(rgba8.size(), 4U * 7U);
  EXPECT_THAT(std::vector<int>(rgba8.end() - 4, rgba8.end()), ::testing::ElementsAre(75, 100, 200, 255));
}

TEST(Levels, are_conservative_where_something_is_promised) {
  for (const Technique& technique : techniques()) {
    Settings settings(technique);
    EXPECT_EQ(mips_of(settings), Mips::none) << technique.id;
    if (technique.find("lod") == nullptr) continue;
    settings.set("lod", "mean");
    EXPECT_EQ(mips_of(settings), technique.guarantee == Guarantee::none ? Mips::mean : Mips::conservative);
    EXPECT_NE(guarantee_of(settings), Guarantee::exact) << technique.id;
    settings.set("fade", "footprint");
    EXPECT_EQ(guarantee_of(settings), Guarantee::none) << technique.id;
  }
}

/// Sides of a pixel's image in texels, the shorter one first, by differences between its neighbours.
std::array<double, 2> numeric_sides(const FrameUniforms& frame, int x, int y) {
  const double tiles_per_slope = double{frame.position[2]} / double{frame.position[3]} * double{frame.right[3]};
  const auto side = [&](int dx, int dy) {
    const TextureRay before = pixel_ray(frame, Wrap::repeat, x - dx, y - dy).ray;
    const TextureRay after = pixel_ray(frame, Wrap::repeat, x + dx, y + dy).ray;
    return tiles_per_slope / 2 *
           std::hypot((after.slope_u - before.slope_u) * static_cast<float>(frame.sizes[2]),
                      (after.slope_v - before.slope_v) * static_cast<float>(frame.sizes[3]));
  };
  return {std::min(side(1, 0), side(0, 1)), std::max(side(1, 0), side(0, 1))};
}

class FilteringTest : public BackendTest {};
INSTANTIATE_TEST_SUITE_P(Devices, FilteringTest, ::testing::Values("opengl", "vulkan"), backend_name);

// A chain of plates, one height a level, tells which level a ray has read.
TEST_P(FilteringTest, levels_are_those_of_their_rows_sides) {
  on_every_device([](const Rig& rig) {
    constexpr int kSide = 64;
    constexpr int kLevels = 7;
    const Heightfield heights{.width = kSide, .height = kSide, .texels = std::vector<float>(kSide * kSide)};
    const Scene scene{.view = view_presets()[2], .tiling = 6, .width_px = 24, .height_px = 32};
    const FrameUniforms frame = frame_uniforms(scene, kSide, kSide);
    for (const char* technique : {"relief", "parallax"})
      for (const std::string lod : {"footprint", "minimum", "mean"}) {
        Settings settings = settings_of(technique, {{"lod", lod}, {"format", "r32f"}, {"filter", "manual"}});
        if (settings.technique().id == "parallax") settings.set("variant", "plain");
        StoredMap map = store_map(settings, heights, Wrap::repeat);
        ASSERT_EQ(map.textures.relief.levels, kLevels);
        std::vector<float> texels;
        for (int level = 0; level < kLevels; ++level)
          texels.insert(texels.end(), static_cast<std::size_t>(level_side(kSide, level) * level_side(kSide, level)),
                        1 - static_cast<float>(level) / 8);
        const auto bytes = std::as_bytes(std::span(texels));
        map.textures.relief.texels.assign(bytes.begin(), bytes.end());
        const std::vector<ScorePixel> pixels = trace_frame(rig, settings, map, scene);
        std::set<int> seen;
        for (int y = 1; y < scene.height_px; ++y)
          for (int x = 1; x < scene.width_px; ++x) {
            const ScorePixel& pixel = pixels[static_cast<std::size_t>(y * scene.width_px + x)];
            if (static_cast<PixelStatus>(pixel.status) != PixelStatus::hit) continue;
            const auto [shorter, longer] = numeric_sides(frame, x, y);
            const double side = lod == "footprint" ? longer : lod == "minimum" ? shorter : (shorter + longer) / 2;
            const double level = std::clamp(std::log2(side), 0.0, kLevels - 1.0);
            const int found = static_cast<int>(std::lround(pixel.t * 8));
            seen.insert(found);
            EXPECT_GE(found, std::floor(level - 0.1)) << technique << " " << lod << " " << x << " " << y;
            EXPECT_LE(found, std::floor(level + 0.1)) << technique << " " << lod << " " << x << " " << y;
          }
        EXPECT_GE(seen.size(), 2U) << technique << " " << lod;
      }
  });
}

TEST_P(FilteringTest, coarse_nodes_stop_before_the_base) {
  on_every_device([](const Rig& rig) {
    const Scene scene{.view = view_presets()[2], .tiling = 6, .width_px = 40, .height_px = 40};
    for (const char* id : {"max_mip", "cone", "quad_cone"}) {
      Settings settings = settings_of(id, {{"format", id == std::string("quad_cone") ? "r32f+rgba32f"
                                                      : id == std::string("cone")    ? "rg32f"
                                                                                     : "r32f"}});
      if (settings.technique().find("cone_steps") != nullptr) settings.set("cone_steps", 512);
      const auto traced = [&](std::string_view lod) {
        settings.set("lod", lod);
        return trace_frame(rig, settings, store_map(settings, small_fbm(), Wrap::repeat), scene);
      };
      const std::vector<ScorePixel> base = traced("base");
      const std::vector<ScorePixel> coarse = traced("footprint");
      int earlier = 0;
      for (std::size_t i = 0; i < base.size(); ++i) {
        EXPECT_LE(coarse[i].t, base[i].t + 1e-4F) << id << " " << i;
        earlier += coarse[i].t < base[i].t - 0.01F ? 1 : 0;
      }
      EXPECT_GT(earlier, 0) << id;
    }
  });
}

TEST_P(FilteringTest, relief_fades_to_the_polygon_wherever_it_lies) {
  on_every_device([](const Rig& rig) {
    Scene scene{
        .view = {.id = "v", .elevation_deg = 20, .distance = 4, .fov_deg = 70}, .width_px = 32, .height_px = 48};
    const Settings plain = settings_of("relief", {{"format", "r32f"}});
    Settings faded = plain;
    faded.set("fade", "distance");
    faded.set("fade_distance", 6);
    const StoredMap map = store_map(plain, small_fbm(), Wrap::repeat);
    for (const double base : {1.0, 0.5, 0.0}) {
      scene.base = base;
      const double polygon_t = 1 - base;
      const FrameUniforms frame = frame_uniforms(scene, 32, 32);
      const std::vector<ScorePixel> whole = trace_frame(rig, plain, map, scene);
      const std::vector<ScorePixel> found = trace_frame(rig, faded, map, scene);
      std::array<int, 3> kinds{};
      for (std::size_t i = 0; i < found.size(); ++i) {
        if (static_cast<PixelStatus>(found[i].status) == PixelStatus::no_ray) continue;
        // From the eye to the polygon: the slope is the way on it for each unit of height, times the depth.
        const double tangent = std::hypot(found[i].ray.slope_u, found[i].ray.slope_v) / double{frame.position[3]};
        const double distance = double{frame.position[2] + frame.surface[2]} * std::hypot(1.0, tangent);
        if (distance > 6.001) {
          EXPECT_NEAR(found[i].t, polygon_t, 1e-6);
          EXPECT_EQ(found[i].taps, 0);
          ++kinds[0];
        } else if (distance < 2.999) {
          EXPECT_EQ(std::memcmp(&found[i], &whole[i], sizeof found[i]), 0);
          ++kinds[1];
        } else {
          const double left = std::min(1.0, 2 - distance / 3);
          EXPECT_GE(found[i].t, polygon_t * (1 - left) - 1e-4);
          EXPECT_LE(found[i].t, polygon_t + base * left + 1e-4);
          ++kinds[2];
        }
      }
      for (const int count : kinds) EXPECT_GT(count, 10) << base;
    }
  });
}

TEST(Shifted, rays_go_through_another_point_of_their_pixel) {
  const Scene scene{.view = view_presets()[1], .width_px = 20, .height_px = 10};
  const FrameUniforms frame = frame_uniforms(scene, 8, 8);
  const FrameUniforms moved = shifted(frame, 1, -1);
  for (int y = 3; y < 9; ++y) {
    const TextureRay one = pixel_ray(moved, Wrap::clamp, 8, y).ray;
    const TextureRay other = pixel_ray(frame, Wrap::clamp, 9, y - 1).ray;
    EXPECT_NEAR(one.slope_u, other.slope_u, 1e-5);
    EXPECT_NEAR(one.slope_v, other.slope_v, 1e-5);
  }
  EXPECT_EQ(shifted(frame, 0, 0), frame);
}

/// The error of a setting far away, and the reference that it is held against.
std::pair<FrameScore, std::vector<std::uint8_t>> seen(std::string_view backend, const Settings& settings,
                                                      Picture reference) {
  WallSplit split;
  const Cache cache = Cache::open();
  MapLibrary library(cache, split);
  Session session(find_backend(backend), 0, split, {.audits = Audits::none});
  Preparer preparer(
      {.session = session, .library = library, .cache = cache, .split = split, .timeout_s = 20, .flicker_frames = 0});
  const SceneSpec scene{.id = "bricks/far",
                        .heightmap = {.source = "bricks", .width = 64, .height = 64},
                        .scene = {.view = {.id = "far", .elevation_deg = 60, .distance = 2},
                                  .relief_depth = 0.05,
                                  .tiling = 24,
                                  .width_px = 48,
                                  .height_px = 48,
                                  .reference = reference}};
  const Case c{.settings = settings, .scene_id = scene.id, .backend = std::string(backend)};
  const PreparedCase prepared = preparer.prepare(c, scene);
  EXPECT_EQ(prepared.record.status, Status::ok) << prepared.record.reason;
  return {*prepared.record.error, preparer.pictures(c, scene).reference};
}

double spread(const std::vector<std::uint8_t>& rgba8) {
  double sum = 0;
  double squares = 0;
  for (std::size_t i = 0; i < rgba8.size(); i += 4) {
    sum += rgba8[i];
    squares += 1.0 * rgba8[i] * rgba8[i];
  }
  const double count = static_cast<double>(rgba8.size()) / 4;
  return squares / count - sum / count * (sum / count);
}

// Far away a pixel covers many texels. One ray sees one of them; the mean of 16 varies less.
TEST_P(FilteringTest, of_a_supersampled_reference_aliasing_is_an_error) {
  const Settings trembling = settings_of("flat");
  const Settings calm = settings_of("flat", {{"normals", "footprint"}});
  const auto [base, mean] = seen(GetParam(), trembling, Picture::supersampled);
  const auto [levels, same] = seen(GetParam(), calm, Picture::supersampled);
  const auto [base_by_point, one_ray] = seen(GetParam(), trembling, Picture::point);
  EXPECT_EQ(mean, same);
  EXPECT_NE(levels.at("flip"), base.at("flip"));
  EXPECT_NE(base_by_point.at("flip"), base.at("flip"));
  EXPECT_LT(spread(mean), 0.5 * spread(one_ray));
}

TEST_P(FilteringTest, of_a_supersampled_reference_the_object_that_is_seen_is_the_pixels_own) {
  const Settings depth = settings_of("relief", {{"linear_steps", "8"}, {"depth", "write"}});
  const auto [mean, many_rays] = seen(GetParam(), depth, Picture::supersampled);
  const auto [point, one_ray] = seen(GetParam(), depth, Picture::point);
  EXPECT_NE(many_rays, one_ray);
  EXPECT_EQ(mean.at("wrong_visible_rate"), point.at("wrong_visible_rate"));
}

// A setting without shadow is near to a reference that has none either; a complete one has. Objects are in its frame
// where they are in the setting's.
TEST_P(FilteringTest, of_a_complete_reference_what_a_setting_leaves_out_is_an_error) {
  const auto with = [](std::vector<std::pair<std::string_view, std::string_view>> values) {
    values.emplace_back("linear_steps", "32");
    return settings_of("relief", values);
  };
  const auto [own, lit] = seen(GetParam(), with({}), Picture::point);
  const auto [left_out, complete] = seen(GetParam(), with({}), Picture::point_complete);
  const auto [shadowed, same] = seen(GetParam(), with({{"shadow", "linear"}}), Picture::point_complete);
  const auto [whole, objects] =
      seen(GetParam(), with({{"shadow", "linear"}, {"depth", "write"}}), Picture::point_complete);
  EXPECT_NE(lit, complete);
  EXPECT_EQ(complete, same);
  EXPECT_NE(complete, objects);
  EXPECT_GT(left_out.at("flip"), own.at("flip"));
  EXPECT_LT(shadowed.at("flip"), left_out.at("flip"));
  EXPECT_LT(whole.at("flip"), left_out.at("flip"));
}

TEST_P(FilteringTest, a_supersampled_reference_is_the_same_to_a_frame_of_several_draws) {
  EXPECT_EQ(seen(GetParam(), settings_of("depth_passes", {{"passes", "8"}}), Picture::supersampled).second,
            seen(GetParam(), settings_of("depth_slices", {{"slices", "8"}}), Picture::supersampled).second);
}

}  // namespace
}  // namespace reliefbench
