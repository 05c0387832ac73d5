// Rows of the feature `shadow` on devices, against the exact reference.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/image/heightmap.h"
#include "kernels/judge/light.h"
#include "kernels/judge/score.h"
#include "kernels/trace/guarantee.h"
#include "tests/technique_rig.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

using ShadowTest = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, ShadowTest, ::testing::Values("opengl", "vulkan"),
                         [](const auto& parameter) { return std::string(parameter.param); });

/// Every row but `none`.
std::vector<std::string_view> shadow_ids() {
  std::vector<std::string_view> ids;
  for (const Feature& feature : all_features())
    if (feature.id == "shadow")
      for (const FeatureRow& row : feature.rows) ids.push_back(row.id);
  ids.erase(ids.begin());
  return ids;
}

/// What a frame found of hits and light.
struct LitFrame {
  std::vector<ScorePixel> pixels;
  std::vector<float> light;
  FrameUniforms frame{};
};

LitFrame lit_frame(const Rig& rig, const Settings& settings, const StoredMap& map, const Scene& scene) {
  LitFrame lit{.pixels = trace_frame(rig, settings, map, scene), .light = {}};
  lit.light = rig.backend->read_values(pixel_features(settings)).front();
  lit.frame = frame_uniforms(scene, map.surface.width, map.surface.height);
  return lit;
}

FrameScore judged(const Settings& settings, const LitFrame& lit, const StoredMap& map, Wrap wrap) {
  const ReferenceTracer tracer(map.surface, wrap);
  const std::vector<ReferenceHit> hits = exact_hits(tracer, lit.pixels);
  JudgedFrame frame = judge(lit.pixels, hits, map.surface.width, map.surface.height);
  const std::vector<PixelFeature> features = pixel_features(settings);
  judge_features(features, {lit.light}, exact_values(features, tracer, lit.frame, rays_of(lit.pixels), hits),
                 frame.pixels, frame.score);
  return frame.score;
}

constexpr Light kLow{.elevation_deg = 12, .azimuth_deg = 205};

Scene shadow_scene(const View& view, Wrap wrap, const Light& light) {
  return {.view = view,
          .tiling = wrap == Wrap::repeat ? 2.0 : 1.0,
          .wrap = wrap,
          .width_px = 48,
          .height_px = 48,
          .light = light};
}

/// Exact hits and free cones in full precision.
Settings cone_settings(std::string_view filter) {
  return settings_of("cone", {{"format", "rg32f"},
                              {"encoding", "ratio"},
                              {"cone_steps", "2000"},
                              {"filter", filter},
                              {"shadow", "cone"},
                              {"shadow_steps", "2000"}});
}
/// The same of cones of cells.
Settings cell_settings(std::string_view format = "rg32f", std::string_view encoding = "ratio") {
  return settings_of("cell_cone", {{"format", format},
                                   {"encoding", encoding},
                                   {"cone_steps", "2000"},
                                   {"shadow", "cell"},
                                   {"shadow_steps", "2000"}});
}

TEST_P(ShadowTest, of_free_cones_lights_nothing_that_is_in_shadow) {
  on_every_device([](const Rig& rig) {
    for (const Settings& settings : {cone_settings("manual"), cone_settings("hardware"), cell_settings(),
                                     cell_settings("rg16", "sqrt"), cell_settings("rg8", "sqrt")})
      for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
        ASSERT_EQ(guarantee_of(settings, Query::shadow), Guarantee::never_skips);
        for (const ProceduralRow& row : procedurals()) {
          const StoredMap map = store_map(settings, row.generate(32, 32, 7), wrap);
          const ReferenceTracer tracer(map.surface, wrap);
          for (const Light& light : {Light{}, kLow, Light{.elevation_deg = 2, .azimuth_deg = 45}}) {
            const LitFrame lit = lit_frame(rig, settings, map, shadow_scene(view_presets()[1], wrap, light));
            const PixelFeature feature = pixel_features(settings).front();
            const FrameScore score = judged(settings, lit, map, wrap);
            const std::string what =
                fmt::format("{} {} {} {}", row.id, setting_id(settings), static_cast<int>(wrap), light.elevation_deg);
            EXPECT_EQ(feature.feature->value->broken(tracer, lit.frame, lit.pixels, lit.light), 0) << what;
            EXPECT_LE(score.at("false_dark_rate"), 0.01) << what;  // edges
            EXPECT_LT(std::ranges::count(lit.light, 0.0F), std::ssize(lit.light)) << what;
          }
        }
      }
  });
}

// The numbers that reports have: hits are found within 2^-14, and so shadows are, but for edges.
TEST_P(ShadowTest, of_free_cones_is_the_references_but_for_edges) {
  on_every_device([](const Rig& rig) {
    for (const Settings& settings : {cone_settings("manual"), cell_settings()}) {
      const StoredMap map = store_map(settings, small_fbm(), Wrap::repeat);
      const Scene scene = shadow_scene(view_presets()[1], Wrap::repeat, kLow);
      const FrameScore score = judged(settings, lit_frame(rig, settings, map, scene), map, scene.wrap);
      EXPECT_LT(score.at("false_lit_rate"), 0.002);
      EXPECT_LT(score.at("false_dark_rate"), 0.002);
      EXPECT_EQ(score.at("penumbra_error"), score.at("false_lit_rate") + score.at("false_dark_rate"));
    }
  });
}

// Of what fades: at the polygon nothing is dark, wherever that lies. Of coarser levels: hits on one are not under
// another.
TEST_P(ShadowTest, is_that_of_the_relief_that_was_traced) {
  on_every_device([](const Rig& rig) {
    Scene scene = shadow_scene({.id = "v", .elevation_deg = 35, .distance = 3, .fov_deg = 40}, Wrap::repeat, {});
    for (const std::string shadow : {"linear", "binary", "soft_taps"}) {
      const auto dark = [&](const std::string& more) {
        const Settings settings = parse_setting("relief?format=r32f&linear_steps=256&shadow=" + shadow + more);
        const StoredMap map = store_map(settings, small_fbm(), Wrap::repeat);
        return judged(settings, lit_frame(rig, settings, map, scene), map, scene.wrap).at("false_dark_rate");
      };
      scene.tiling = 2;
      for (const double base : {1.0, 0.5, 0.0}) {
        scene.base = base;
        for (const char* distance : {"3", "4"})
          EXPECT_LT(dark(std::string("&fade=distance&fade_distance=") + distance), 0.01) << shadow << " " << base;
      }
      scene.tiling = 8;
      scene.base = 1;
      for (const char* lod : {"footprint", "minimum"})
        EXPECT_LT(dark(std::string("&lod=") + lod), 0.06) << shadow << " " << lod;
    }
  });
}

// A few steps of equal length miss thin relief, many miss less; with cones that are right only from the top plate some
// hits are lit that are not.
TEST_P(ShadowTest, errs_as_its_row_says) {
  on_every_device([](const Rig& rig) {
    const Scene scene = shadow_scene(view_presets()[1], Wrap::repeat, kLow);
    const auto score_of = [&](Settings settings) {
      settings.set("filter", "manual");
      settings.set("format", "rg32f");
      const StoredMap map =
          store_map(settings, load_heightmap({.source = "spikes", .width = 48, .height = 48}), scene.wrap);
      return judged(settings, lit_frame(rig, settings, map, scene), map, scene.wrap);
    };
    const auto linear = [](std::string_view steps) {
      return settings_of("cone", {{"cone_steps", "500"}, {"shadow", "linear"}, {"shadow_steps", steps}});
    };
    const double few = score_of(linear("4")).at("false_lit_rate");
    const double many = score_of(linear("400")).at("false_lit_rate");
    EXPECT_GT(few, 0.01);
    EXPECT_LT(many, 0.1 * few);
    const auto cones = [](std::string_view map) {
      return settings_of("relaxed_cone",
                         {{"map", map}, {"cone_steps", "200"}, {"shadow", "cone"}, {"shadow_steps", "200"}});
    };
    EXPECT_GT(score_of(cones("relaxed")).at("false_lit_rate"), 0.005);
    // Without steps all is dark.
    const FrameScore none =
        score_of(settings_of("cone", {{"cone_steps", "500"}, {"shadow", "cone"}, {"shadow_steps", "1"}}));
    EXPECT_EQ(none.at("false_lit_rate"), 0);
  });
}

TEST_P(ShadowTest, of_every_row_knows_the_horizon_and_the_zenith) {
  on_every_device([](const Rig& rig) {
    std::vector<Settings> every{cell_settings()};
    for (const std::string_view id : shadow_ids())
      if (id != "cell")
        every.push_back(settings_of("cone", {{"format", "rg32f"}, {"filter", "manual"}, {"shadow", id}}));
    for (Settings& settings : every)
      for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
        for (const double elevation_deg : {-90.0, -10.0, 0.0, 1e-4, 90.0}) {
          settings.set("cone_steps", 500);
          const std::string_view id = settings.choice("shadow");
          const StoredMap map = store_map(settings, small_fbm(), wrap);
          const LitFrame lit =
              lit_frame(rig, settings, map, shadow_scene(view_presets()[1], wrap, {.elevation_deg = elevation_deg}));
          for (std::size_t i = 0; i < lit.pixels.size(); ++i) {
            if (static_cast<PixelStatus>(lit.pixels[i].status) == PixelStatus::no_ray) continue;
            ASSERT_TRUE(lit.light[i] >= 0 && lit.light[i] <= 1) << id << elevation_deg;
            if (elevation_deg <= 0) {
              ASSERT_EQ(lit.light[i], 0) << id;
            }
            if (elevation_deg == 90) {
              ASSERT_EQ(lit.light[i], 1) << id;
            }
          }
        }
  });
}

TEST(Shadow, needs_a_map_that_knows_what_it_asks) {
  const auto why = [](std::string_view setting) { return conflict(parse_setting(setting)); };
  EXPECT_EQ(why("cell_cone?shadow=cell"), "");
  EXPECT_EQ(why("sector_cone?shadow=soft_cone"), "");
  EXPECT_THAT(why("cone?shadow=cell"), HasSubstr("needs a map with a cone a cell"));
  for (const char* setting : {"max_mip?shadow=cone", "quad_cone?shadow=cone", "cell_cone?shadow=soft_cone"})
    EXPECT_THAT(why(setting), HasSubstr("needs a map with one cone a texel")) << setting;
}

// The hits are the same with and without: a feature of the scene looks at them, and no more.
TEST_P(ShadowTest, leaves_the_hits_alone) {
  on_every_device([](const Rig& rig) {
    const Scene scene = shadow_scene(view_presets()[2], Wrap::repeat, kLow);
    std::size_t number = 0;
    for (const Technique& technique : techniques()) {
      if (technique.find("shadow") == nullptr) continue;
      Settings settings(technique);
      const StoredMap map = store_map(settings, small_fbm(), scene.wrap);
      const std::vector<ScorePixel> plain = trace_frame(rig, settings, map, scene);
      for (const std::string_view id : shadow_ids()) {
        Settings shadowed = settings;
        shadowed.set("shadow", id);
        if (!conflict(shadowed).empty() || !is_tried_here(rig, number++)) continue;
        const LitFrame lit = lit_frame(rig, shadowed, map, scene);
        const bool makes_up = makes_up_for_filter(settings) != makes_up_for_filter(shadowed);
        for (std::size_t i = 0; i < plain.size(); ++i) {
          ASSERT_TRUE(makes_up || plain[i].t == lit.pixels[i].t) << technique.id << " " << id;
          ASSERT_GE(lit.pixels[i].taps, plain[i].taps) << technique.id << " " << id;
          ASSERT_LE(lit.pixels[i].steps, static_cast<float>(step_cap(shadowed))) << technique.id << " " << id;
        }
      }
    }
  });
}

}  // namespace
}  // namespace reliefbench
