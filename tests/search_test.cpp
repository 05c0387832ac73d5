// Linear and cone searches, their minima and levels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "kernels/image/heightmap.h"
#include "kernels/trace/depth.h"
#include "tests/technique_rig.h"

namespace reliefbench {
namespace {

const Scene kTiled{.view = {.id = "oblique", .elevation_deg = 30, .distance = 1.6, .fov_deg = 35},
                   .tiling = 2,
                   .width_px = 48,
                   .height_px = 48};

using SearchOnDevices = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, SearchOnDevices, ::testing::Values("opengl", "vulkan"),
                         [](const auto& parameter) { return std::string(parameter.param); });

void expect_same_work(const std::vector<ScorePixel>& a, const std::vector<ScorePixel>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].t, b[i].t) << "pixel " << i;
    ASSERT_EQ(a[i].taps, b[i].taps) << "pixel " << i;
    ASSERT_EQ(a[i].steps, b[i].steps) << "pixel " << i;
  }
}

TEST_P(SearchOnDevices, interval_steps_are_secant_probes_and_a_last_chord) {
  on_every_device([](const Rig& rig) {
    const auto frame = [&](const Settings& settings) {
      return trace_frame(rig, settings, store_map(settings, small_fbm(), kTiled.wrap), kTiled);
    };
    for (const std::string_view chords : {"0", "1", "4"}) {
      const std::string_view refinement = chords == "0" ? "none" : "secant";
      const std::string_view probes = chords == "4" ? "3" : "0";
      expect_same_work(
          frame(settings_of("interval", {{"interval_steps", chords}})),
          frame(settings_of("relief", {{"refinement", refinement}, {"secant_steps", probes}, {"format", "rg16"}})));
      expect_same_work(frame(settings_of("interval", {{"search", "cone"}, {"interval_steps", chords}})),
                       frame(settings_of("relaxed_cone", {{"refinement", refinement}, {"secant_steps", probes}})));
    }
  });
}

// The planes are relief mapping's linear steps but for the top plate, which is no plane.
TEST_P(SearchOnDevices, depth_slices_take_the_highest_plane_under_the_surface) {
  on_every_device([](const Rig& rig) {
    const Settings linear = settings_of("relief", {{"linear_steps", "20"}, {"refinement", "none"}});
    const StoredMap map = store_map(linear, small_fbm(), kTiled.wrap);
    const auto expected = trace_frame(rig, linear, map, kTiled);
    for (const std::string_view loop : {"fixed", "early_exit"}) {
      const auto found = trace_frame(rig, settings_of("depth_slices", {{"slices", "20"}, {"loop", loop}}), map, kTiled);
      for (std::size_t i = 0; i < found.size(); ++i) {
        if (expected[i].t > 0) {
          EXPECT_EQ(found[i].t, expected[i].t) << loop;
        }
        if (loop == "fixed") {
          EXPECT_EQ(found[i].taps, 20);
        }
      }
    }
  });
}

// Passes and the loop are the same planes, to the bit; later ones overwrite, or, where there is depth, nearer ones win.
TEST_P(SearchOnDevices, passes_are_the_loop_of_slices) {
  on_every_device([](const Rig& rig) {
    for (const std::string_view filter : {"hardware", "manual"})
      for (const std::string_view count : {"1", "2", "20", "256"}) {
        const Settings loop = settings_of("depth_slices", {{"slices", count}, {"loop", "fixed"}, {"filter", filter}});
        const Settings passes = settings_of("depth_passes", {{"passes", count}, {"filter", filter}});
        const StoredMap map = store_map(loop, small_fbm(), kTiled.wrap);
        const auto expected = trace_frame(rig, loop, map, kTiled);
        const auto found = trace_frame(rig, passes, map, kTiled);
        EXPECT_EQ(std::memcmp(found.data(), expected.data(), found.size() * sizeof(ScorePixel)), 0) << count;
      }
  });
}

// On a constant surface the planes across the view are at most one of them too deep, but for rays that run out of them.
TEST_P(SearchOnDevices, passes_that_face_the_camera_err_by_one_plane) {
  on_every_device([](const Rig& rig) {
    const Heightfield map = {.width = 8, .height = 8, .texels = std::vector<float>(64, 0.5F)};
    const Scene scene{.view = view_presets()[1], .width_px = 32, .height_px = 32};
    const Settings settings = settings_of("depth_passes", {{"passes", "64"}, {"facing", "camera"}, {"format", "r32f"}});
    const auto pixels = trace_frame(rig, settings, store_map(settings, map, scene.wrap), scene);
    for (int y = 16; y < 32; ++y)  // below the middle, where rays are shorter than there
      for (int x = 0; x < 32; ++x) {
        const ScorePixel& pixel = pixels[static_cast<std::size_t>(32 * y + x)];
        const PixelDepths depths = pixel_depths(frame_uniforms(scene, 8, 8), scene.wrap, x, y);
        const double spacing = depths.fall / 0.5 / 64;  // of t; the middle ray falls by sin(30 degrees)
        EXPECT_GE(pixel.t, 0.5 - 1e-4);
        EXPECT_LE(pixel.t, 0.5 + spacing + 1e-4) << x << " " << y;
        EXPECT_EQ(pixel.taps, 64);
      }
  });
}

// Wider cones than with the 3x3 minimum, for one more tap a look; h*tan codes need the texels' heights as well.
TEST_P(SearchOnDevices, four_texel_minima_are_wider_than_dilated_cones) {
  on_every_device([](const Rig& rig) {
    const auto totals = [&](std::string_view correction, std::string_view filter, std::string_view encoding) {
      const Settings settings = settings_of("cone", {{"correction", correction},
                                                     {"step", "plain"},
                                                     {"cone_steps", "400"},
                                                     {"format", "rg32f"},
                                                     {"encoding", encoding},
                                                     {"filter", filter}});
      double steps = 0;
      double taps_per_look = 0;
      for (const ScorePixel& pixel :
           trace_frame(rig, settings, store_map(settings, small_fbm(), kTiled.wrap), kTiled)) {
        if (static_cast<PixelStatus>(pixel.status) != PixelStatus::hit) continue;
        steps += pixel.steps;
        taps_per_look = pixel.taps / (pixel.steps + 1);  // the last look arrives
      }
      return std::pair(steps, taps_per_look);
    };
    for (const std::string_view encoding : {"ratio", "h_tan"}) {
      const auto [safe_steps, safe_taps] = totals("safe", "manual", encoding);
      const auto [min4_steps, min4_taps] = totals("min4", "manual", encoding);
      EXPECT_LT(min4_steps, safe_steps);
      EXPECT_EQ(safe_taps, 4);
      EXPECT_EQ(min4_taps, 4);
      const auto [gather_steps, gather_taps] = totals("min4", "hardware", encoding);
      EXPECT_NEAR(gather_steps, min4_steps, 0.01 * min4_steps);
      EXPECT_EQ(gather_taps, encoding == "h_tan" ? 3 : 2);
    }
  });
}

/// Longer side of a pixel's image in texels, by differences between its neighbours. From the slopes, since uv drop
/// whole tiles.
double numeric_footprint(const FrameUniforms& frame, Wrap wrap, int x, int y) {
  const double tiles_per_slope = double{frame.position[2]} / double{frame.position[3]} * double{frame.right[3]};
  const auto side = [&](int dx, int dy) {
    const TextureRay before = pixel_ray(frame, wrap, x - dx, y - dy).ray;
    const TextureRay after = pixel_ray(frame, wrap, x + dx, y + dy).ray;
    return tiles_per_slope / 2 *
           std::hypot((after.slope_u - before.slope_u) * static_cast<float>(frame.sizes[2]),
                      (after.slope_v - before.slope_v) * static_cast<float>(frame.sizes[3]));
  };
  return std::max(side(1, 0), side(0, 1));
}

// A chain of plates, one height a level, tells which level a ray has read.
TEST_P(SearchOnDevices, the_level_is_that_of_the_pixels_footprint) {
  on_every_device([](const Rig& rig) {
    constexpr int kSide = 64;
    constexpr int kLevels = 7;
    const Settings settings = settings_of("cone", {{"lod", "footprint"}, {"format", "rg32f"}, {"filter", "manual"}});
    const Heightfield heights{.width = kSide, .height = kSide / 2, .texels = std::vector<float>(kSide * kSide / 2)};
    StoredMap map = store_map(settings, heights, Wrap::repeat);
    ASSERT_EQ(map.textures.relief.levels, kLevels);
    std::vector<float> texels;
    for (int level = 0; level < kLevels; ++level)
      for (int i = 0; i < level_side(kSide, level) * level_side(kSide / 2, level); ++i)
        texels.insert(texels.end(), {1 - static_cast<float>(level) / 8, 0.0F});
    const auto bytes = std::as_bytes(std::span(texels));
    map.textures.relief.texels.assign(bytes.begin(), bytes.end());
    std::set<int> seen;
    for (const View& view : view_presets()) {
      const Scene scene{.view = view, .tiling = 3, .width_px = 24, .height_px = 32};
      const FrameUniforms frame = frame_uniforms(scene, kSide, kSide / 2);
      const auto pixels = trace_frame(rig, settings, map, scene);
      for (int y = 0; y < scene.height_px; ++y)
        for (int x = 0; x < scene.width_px; ++x) {
          const ScorePixel& pixel = pixels[static_cast<std::size_t>(y * scene.width_px + x)];
          if (static_cast<PixelStatus>(pixel.status) != PixelStatus::hit) continue;
          const double footprint = numeric_footprint(frame, scene.wrap, x, y);
          if (footprint > 16) continue;  // towards the horizon the differences are too coarse
          const double level = std::max(0.0, std::log2(footprint));
          const int found = static_cast<int>(std::lround(pixel.t * 8));
          seen.insert(found);
          EXPECT_GE(found, std::floor(level - 0.05)) << view.id << " " << x << " " << y;
          EXPECT_LE(found, std::floor(level + 0.05)) << view.id << " " << x << " " << y;
        }
    }
    EXPECT_GE(seen.size(), 3);
  });
}

}  // namespace
}  // namespace reliefbench
