// What the registry promises, held against the exact reference on the heights as they are stored.
#include <gtest/gtest.h>

#include <cmath>

#include "kernels/heightmap.h"
#include "kernels/score.h"
#include "tests/technique_rig.h"

namespace reliefbench {
namespace {

std::vector<ReferenceHit> reference_of(const std::vector<ScorePixel>& pixels, const Heightfield& surface, Wrap wrap) {
  std::vector<TextureRay> rays;
  rays.reserve(pixels.size());
  for (const ScorePixel& pixel : pixels) rays.push_back(pixel.ray);
  return ReferenceTracer(surface, wrap).trace(rays);
}

Scene scene_of(const View& view, Wrap wrap) {
  return {.view = view, .tiling = wrap == Wrap::repeat ? 2.0 : 1.0, .wrap = wrap, .width_px = 64, .height_px = 64};
}

Scene small_scene_of(const View& view, Wrap wrap) {
  Scene scene = scene_of(view, wrap);
  scene.width_px = scene.height_px = 32;
  return scene;
}

using GuaranteeTest = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, GuaranteeTest, ::testing::Values("opengl", "vulkan"),
                         [](const auto& parameter) { return std::string(parameter.param); });

// cone, correction=safe, step=cell_quad: no first hit is stepped over, and none is left short while the cap is not
// reached. Manual filter: full-precision weights, so that the sampled surface is the stored one.
TEST_P(GuaranteeTest, safe_cones_with_solved_cells_never_skip) {
  on_every_device([](const Rig& rig) {
    for (const ProceduralRow& row : procedurals()) {
      const Heightfield heights = row.generate(48, 48, 7);
      for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
        for (const std::string_view format : {"rg8", "rg16", "rg16f", "rg32f"}) {
          const Settings settings = settings_of("cone", {{"cone_steps", "2000"},
                                                         {"correction", "safe"},
                                                         {"step", "cell_quad"},
                                                         {"format", format},
                                                         {"filter", "manual"}});
          const StoredMap map = store_map(settings, heights, wrap);
          for (const View& view : view_presets()) {
            const Scene scene = scene_of(view, wrap);
            const auto pixels = trace_frame(rig, settings, map, scene);
            const FrameScore score =
                judge_frame(pixels, reference_of(pixels, map.surface, wrap), map.surface.width, map.surface.height)
                    .score;
            EXPECT_EQ(score.missed_rate, 0) << row.id << " " << format << " " << view.id;
            EXPECT_EQ(score.unconverged_rate, 0) << row.id << " " << format << " " << view.id;
          }
        }
      }
    }
  });
}

// Plain steps with safe cones: slow to arrive, but nothing is stepped over either.
TEST_P(GuaranteeTest, safe_cones_with_plain_steps_never_skip) {
  on_every_device([](const Rig& rig) {
    for (const ProceduralRow& row : procedurals()) {
      const Settings settings = settings_of("cone", {{"cone_steps", "200"},
                                                     {"correction", "safe"},
                                                     {"step", "plain"},
                                                     {"format", "rg32f"},
                                                     {"filter", "manual"}});
      const StoredMap map = store_map(settings, row.generate(48, 48, 7), Wrap::repeat);
      for (const View& view : view_presets()) {
        const auto pixels = trace_frame(rig, settings, map, scene_of(view, Wrap::repeat));
        EXPECT_EQ(judge_frame(pixels, reference_of(pixels, map.surface, Wrap::repeat), 48, 48).score.missed_rate, 0)
            << row.id << " " << view.id;
      }
    }
  });
}

// The four texels' minimum instead of the 3x3 minimum, in every layout, and with the encoding that needs heights too.
TEST_P(GuaranteeTest, four_texel_minima_never_skip) {
  on_every_device([](const Rig& rig) {
    for (const auto& [format, encoding] :
         {std::pair("rg16", "h_tan"), std::pair("rg32f", "ratio"), std::pair("r8+r8", "sqrt")}) {
      const Settings settings = settings_of("cone", {{"cone_steps", "1000"},
                                                     {"correction", "min4"},
                                                     {"format", format},
                                                     {"encoding", encoding},
                                                     {"filter", "manual"}});
      ASSERT_EQ(guarantee_of(settings), Guarantee::exact);
      const auto pipeline = score_pipeline(rig, settings, Wrap::repeat);
      for (const ProceduralRow& row : procedurals()) {
        const StoredMap map = store_map(settings, row.generate(32, 32, 7), Wrap::repeat);
        for (const View& view : view_presets()) {
          const auto pixels = trace_frame(rig, *pipeline, map, small_scene_of(view, Wrap::repeat));
          const FrameScore score = judge_frame(pixels, reference_of(pixels, map.surface, Wrap::repeat), 32, 32).score;
          EXPECT_EQ(score.missed_rate, 0) << row.id << " " << format << " " << view.id;
          // A ray that grazes a ridge within float's rounding may stop there: one was seen in 300,000.
          EXPECT_LE(score.unconverged_rate * static_cast<double>(score.pixels), 1)
              << row.id << " " << format << " " << view.id;
        }
      }
    }
  });
}

// Relaxed cones may skip, but with the cells solved none is left short of the surface: where the cone does not reach
// the cell's border, the hit in the cell is exact.
TEST_P(GuaranteeTest, relaxed_cones_with_solved_cells_arrive) {
  on_every_device([](const Rig& rig) {
    const auto score_of = [&](const ProceduralRow& row, std::string_view step) {
      const Settings settings = settings_of(
          "relaxed_cone", {{"cone_steps", "300"}, {"step", step}, {"format", "rg16"}, {"filter", "manual"}});
      const StoredMap map = store_map(settings, row.generate(32, 32, 7), Wrap::repeat);
      const auto pixels = trace_frame(rig, settings, map, small_scene_of(view_presets()[2], Wrap::repeat));
      return judge_frame(pixels, reference_of(pixels, map.surface, Wrap::repeat), 32, 32).score;
    };
    double plain_error = 0;
    double solved_error = 0;
    for (const ProceduralRow& row : procedurals()) {
      const FrameScore solved = score_of(row, "cell_quad");
      EXPECT_EQ(solved.unconverged_rate, 0) << row.id;
      solved_error += solved.e_xy.mean;
      plain_error += score_of(row, "plain").e_xy.mean;
    }
    EXPECT_LT(solved_error, plain_error);
  });
}

// A coarse level is nowhere under the base, so that no ray goes beyond the base's hit.
TEST_P(GuaranteeTest, coarse_levels_never_pass_the_base_surface) {
  on_every_device([](const Rig& rig) {
    double early = 0;
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      for (const auto& [correction, step] : {std::pair("safe", "cell_quad"), std::pair("min4", "plain")}) {
        const Settings settings = settings_of("cone", {{"cone_steps", "300"},
                                                       {"correction", correction},
                                                       {"step", step},
                                                       {"refinement", "secant"},
                                                       {"lod", "footprint"},
                                                       {"format", "rg16"},
                                                       {"filter", "manual"}});
        ASSERT_EQ(guarantee_of(settings), Guarantee::never_skips);
        const auto pipeline = score_pipeline(rig, settings, wrap);
        for (const ProceduralRow& row : procedurals()) {
          const StoredMap map = store_map(settings, row.generate(75, 50, 7), wrap);
          for (const View& view : view_presets()) {
            const auto pixels = trace_frame(rig, *pipeline, map, small_scene_of(view, wrap));
            const auto reference = reference_of(pixels, map.surface, wrap);
            for (std::size_t i = 0; i < pixels.size(); ++i) {
              if (static_cast<PixelStatus>(pixels[i].status) == PixelStatus::no_ray) continue;
              ASSERT_LE(pixels[i].t, reference[i].t_enter + 1e-5) << row.id << " " << step << " " << view.id;
              early += reference[i].t_enter - pixels[i].t;
            }
          }
        }
      }
    }
    EXPECT_GT(early, 1);  // coarse levels were read
  });
}

// That a test of a guarantee can fail: linear steps do step over spikes.
TEST_P(GuaranteeTest, linear_steps_do_skip_spikes) {
  on_every_device([](const Rig& rig) {
    const Settings settings = settings_of("relief", {{"linear_steps", "16"}, {"format", "r32f"}});
    const StoredMap map =
        store_map(settings, load_heightmap({.source = "spikes", .width = 64, .height = 64}), Wrap::repeat);
    const auto pixels = trace_frame(rig, settings, map, scene_of(view_presets()[2], Wrap::repeat));
    EXPECT_GT(judge_frame(pixels, reference_of(pixels, map.surface, Wrap::repeat), 64, 64).score.missed_rate, 0);
  });
}

// Two software rasterisers of one Mesa run the same arithmetic but for the order of a few operations. Stated tolerance:
// rays agree to the bit; at most 1 pixel in 100 differs by more than 1e-4 in t. Measured here: none does, but for
// relaxed_cone with the manual filter, up to 1 in 200: there an ulp decides whether a step has pierced the relief.
constexpr double kDifferingPixels = 1.0 / 100;
constexpr float kHitTolerance = 1e-4F;

TEST(BackendsAgreeTest, same_case_same_hits) {
  if (opengl_devices().empty() || vulkan_devices().empty()) GTEST_SKIP() << "needs a device of both APIs";
  const auto first_software = [](const std::vector<DeviceInfo>& devices) {
    for (const DeviceInfo& device : devices)
      if (device.software) return device.index;
    return -1;
  };
  const int gl_index = first_software(opengl_devices());
  const int vulkan_index = first_software(vulkan_devices());
  if (gl_index < 0 || vulkan_index < 0) GTEST_SKIP() << "the stated tolerance is for software rasterisers";
  const Rig gl(find_backend("opengl"), gl_index);
  const Rig vulkan(find_backend("vulkan"), vulkan_index);
  const Heightfield heights = load_heightmap({.source = "bricks", .width = 64, .height = 64});
  for (const Technique& technique : techniques()) {
    for (const std::string_view filter : {"hardware", "manual"}) {
      Settings settings(technique);
      if (technique.find("filter") != nullptr) settings.set("filter", filter);
      for (const View& view : view_presets()) {
        const Scene scene = scene_of(view, Wrap::repeat);
        const StoredMap map = store_map(settings, heights, Wrap::repeat);
        const auto a = trace_frame(gl, settings, map, scene);
        const auto b = trace_frame(vulkan, settings, map, scene);
        ASSERT_EQ(a.size(), b.size());
        int differing = 0;
        for (std::size_t i = 0; i < a.size(); ++i) {
          ASSERT_EQ(a[i].ray.u, b[i].ray.u);
          ASSERT_EQ(a[i].ray.v, b[i].ray.v);
          ASSERT_EQ(a[i].ray.slope_u, b[i].ray.slope_u);
          ASSERT_EQ(a[i].ray.slope_v, b[i].ray.slope_v);
          if (std::abs(a[i].t - b[i].t) > kHitTolerance) ++differing;
        }
        EXPECT_LE(differing, kDifferingPixels * static_cast<double>(a.size())) << settings.text() << " " << view.id;
      }
    }
  }
}

}  // namespace
}  // namespace reliefbench
