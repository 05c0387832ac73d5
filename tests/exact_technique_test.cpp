// The techniques on pyramids and volumes, held against the exact reference on the heights as they are stored.
#include <gtest/gtest.h>

#include <cmath>

#include "kernels/image/heightmap.h"
#include "kernels/judge/score.h"
#include "kernels/trace/guarantee.h"
#include "tests/cone_test_maps.h"
#include "tests/slow_cone_map.h"
#include "tests/technique_rig.h"

namespace reliefbench {
namespace {

const std::vector<Settings>& exact_settings() {
  static const std::vector<Settings> list{
      settings_of("max_mip", {{"node_steps", "4096"}}),
      settings_of("distance", {{"sphere_steps", "4096"}, {"step", "cell_quad"}, {"distance_slices", "16"}})};
  return list;
}

/// No first hit stepped over, none short of the surface, none past it inside.
void expect_exact(const std::vector<ScorePixel>& pixels, const StoredMap& map, const Scene& scene) {
  const std::vector<ReferenceHit> reference = exact_hits(ReferenceTracer(map.surface, scene.wrap), pixels);
  const JudgedFrame frame = judge(pixels, reference, map.surface.width, map.surface.height);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Verdict verdict = frame.pixels[i].verdict;
    const Kept kept = keeps(Guarantee::exact, pixels[i], frame.pixels[i], reference[i], map.surface, scene.wrap);
    ASSERT_TRUE(verdict == Verdict::good || verdict == Verdict::no_ray || kept == Kept::unresolved)
        << scene.view.id << ", pixel " << i << ": verdict " << static_cast<int>(verdict) << ", t " << pixels[i].t
        << ", exact " << reference[i].t_enter << " to " << reference[i].t_exit;
  }
}

/// Over frames of every exact technique.
void expect_exact(const Rig& rig, Wrap wrap, const std::vector<std::pair<Heightfield, std::string_view>>& maps,
                  const std::vector<Scene>& scenes) {
  for (Settings settings : exact_settings()) {
    ASSERT_EQ(guarantee_of(settings), Guarantee::exact);
    const auto pipeline = score_pipeline(rig, settings, wrap);
    for (const auto& [heights, format] : maps) {
      settings.set("format", format);
      SCOPED_TRACE(fmt::format("{} {} {}x{}", settings.technique().id, format, heights.width, heights.height));
      const StoredMap map = store_map(settings, heights, wrap);
      for (const Scene& scene : scenes) expect_exact(trace_frame(rig, *pipeline, map, scene), map, scene);
    }
  }
}

Scene small_scene(const View& view, Wrap wrap) {
  return {.view = view, .tiling = wrap == Wrap::repeat ? 2.0 : 1.0, .wrap = wrap, .width_px = 40, .height_px = 40};
}
std::vector<Scene> small_scenes(Wrap wrap) {
  std::vector<Scene> scenes;
  for (const View& view : view_presets()) scenes.push_back(small_scene(view, wrap));
  return scenes;
}

using ExactTechnique = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, ExactTechnique, ::testing::Values("opengl", "vulkan"), backend_name);

TEST_P(ExactTechnique, never_skips_on_any_map_shape_format_wrap_and_view) {
  std::vector<std::pair<Heightfield, std::string_view>> maps;
  for (const ProceduralRow& row : procedurals())
    for (const std::string_view format : {"r8", "r16", "r16f", "r32f"})
      maps.emplace_back(row.generate(48, 48, 7), format);
  for (const auto& [width, height] : {std::pair{2, 2}, {3, 2}, {2, 63}, {33, 5}, {13, 31}})
    maps.emplace_back(noise_map(width, height), "r32f");
  on_every_device([&](const Rig& rig) {
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) expect_exact(rig, wrap, maps, small_scenes(wrap));
  });
}

// Tile factors of 1e-3 and 1e3, a grazing angle of 0.1 degree, reliefs without depth and ten tiles deep.
TEST_P(ExactTechnique, never_skips_at_the_extremes) {
  const View grazing{.id = "0.1 degree", .elevation_deg = 0.1, .distance = 3, .fov_deg = 0.05};
  const View& oblique = view_presets()[1];
  std::vector<Scene> scenes{{.view = grazing}, {.view = view_presets()[2], .relief_depth = 10}};
  for (const double tiling : {1e-3, 1e3}) scenes.push_back({.view = oblique, .tiling = tiling});
  for (const double depth : {0.0, 10.0}) scenes.push_back({.view = oblique, .relief_depth = depth});
  on_every_device([&](const Rig& rig) {
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      for (Scene& scene : scenes) {
        scene.wrap = wrap;
        scene.width_px = scene.height_px = 32;
      }
      expect_exact(rig, wrap, {{fbm_map(24, 20), "r16"}}, scenes);
    }
  });
}

// That these tests can fail: the maxima of texels do not bound the cells between them.
TEST_P(ExactTechnique, maxima_of_texels_do_skip) {
  on_every_device([](const Rig& rig) {
    const Settings settings = settings_of("max_mip", {{"format", "r32f"}});
    const Heightfield heights = load_heightmap({.source = "spikes", .width = 48, .height = 48});
    const MapRow& quadtree = find_map(MapKind::quadtree);
    const std::vector<float> values = quadtree.bake({.heights = heights});
    const StoredMap map{.textures = pack_map({.map = quadtree, .heights = heights, .values = values},
                                             find_format("r32f"), find_encoding("ratio")),
                        .surface = heights};
    const auto pixels = trace_frame(rig, settings, map, small_scene(view_presets()[2], Wrap::repeat));
    EXPECT_GT(
        judge(pixels, exact_hits(ReferenceTracer(map.surface, Wrap::repeat), pixels), 48, 48).score.at("missed_rate"),
        0);
  });
}

// What ends a search is the hit, not the count: with as many steps as it takes it is found, with one less it is not.
TEST_P(ExactTechnique, a_hit_at_the_cap_is_a_hit) {
  on_every_device([](const Rig& rig) {
    const Scene scene = small_scene(view_presets()[1], Wrap::repeat);
    for (const auto& [technique, cap] : {std::pair{"max_mip", "node_steps"}, {"distance", "sphere_steps"}}) {
      Settings settings = settings_of(technique, {{cap, "4096"}});
      const StoredMap map = store_map(settings, fbm_map(32, 32), scene.wrap);
      const auto all = trace_frame(rig, settings, map, scene);
      const ScorePixel& longest =
          *std::max_element(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.steps < b.steps; });
      const auto pixel = static_cast<std::size_t>(&longest - all.data());
      const int steps = static_cast<int>(longest.steps);
      ASSERT_GT(steps, 2) << technique;
      settings.set(cap, steps);
      EXPECT_EQ(trace_frame(rig, settings, map, scene)[pixel].t, longest.t) << technique;
      EXPECT_EQ(trace_frame(rig, settings, map, scene)[pixel].status, static_cast<float>(PixelStatus::hit));
      settings.set(cap, steps - 1);
      EXPECT_EQ(trace_frame(rig, settings, map, scene)[pixel].status, static_cast<float>(PixelStatus::step_cap));
    }
  });
}

// A relief without depth is looked straight down upon: blocks show their texel, refined ones the bilinear surface.
TEST_P(ExactTechnique, qdm_sees_blocks_or_the_surface) {
  on_every_device([](const Rig& rig) {
    const Heightfield heights = noise_map(8, 6);
    const Scene scene{.view = view_presets()[1], .relief_depth = 0, .width_px = 32, .height_px = 32};
    for (const std::string_view refinement : {"none", "secant", "binary"}) {
      const Settings settings = settings_of("qdm", {{"refinement", refinement},
                                                    {"secant_steps", "2"},
                                                    {"binary_steps", "20"},
                                                    {"format", "r32f"},
                                                    {"filter", "manual"}});
      for (const ScorePixel& pixel : trace_frame(rig, settings, store_map(settings, heights, scene.wrap), scene)) {
        const double x = static_cast<double>(pixel.ray.u) * 8;
        const double y = static_cast<double>(pixel.ray.v) * 6;
        const double block = heights.at(wrapped(static_cast<int>(std::floor(x)), 8, scene.wrap),
                                        wrapped(static_cast<int>(std::floor(y)), 6, scene.wrap));
        const double surface = slow_surface(heights, scene.wrap, x - 0.5, y - 0.5);
        ASSERT_NEAR(pixel.t, 1 - (refinement == "none" ? block : surface), 1e-4) << refinement;
      }
    }
  });
}

// Where the relief is smooth the searches without a guarantee are near, too.
TEST_P(ExactTechnique, refined_searches_are_near_on_a_smooth_relief) {
  const Heightfield smooth = make_map(32, 32, [](int x, int y) {
    constexpr float kWave = 2 * 3.14159265F / 32;
    return 0.5F + 0.25F * (std::sin(kWave * static_cast<float>(x)) + std::cos(kWave * static_cast<float>(y)));
  });
  on_every_device([&](const Rig& rig) {
    for (const std::string_view refinement : {"secant", "binary"}) {
      for (const Settings& settings :
           {settings_of("qdm", {{"refinement", refinement}}),
            settings_of("distance", {{"step", "published"}, {"refinement", refinement}, {"sphere_steps", "4096"}})}) {
        const StoredMap map = store_map(settings, smooth, Wrap::repeat);
        const auto pipeline = score_pipeline(rig, settings, Wrap::repeat);
        for (const View& view : view_presets()) {
          const auto pixels = trace_frame(rig, *pipeline, map, small_scene(view, Wrap::repeat));
          const FrameScore score =
              judge(pixels, exact_hits(ReferenceTracer(map.surface, Wrap::repeat), pixels), 32, 32).score;
          EXPECT_LT(score.at("e_xy.p95"), 0.1) << settings.text() << " " << view.id;
          EXPECT_LT(score.at("missed_rate"), 0.01) << settings.text() << " " << view.id;
          EXPECT_EQ(score.at("unconverged_rate"), 0) << settings.text() << " " << view.id;
        }
      }
    }
  });
}

}  // namespace
}  // namespace reliefbench
