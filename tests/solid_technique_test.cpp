// Techniques of solids on devices, held to the exact reference on the heights as they are stored.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "kernels/image/heightmap.h"
#include "kernels/judge/score.h"
#include "kernels/trace/guarantee.h"
#include "tests/technique_rig.h"

namespace reliefbench {
namespace {

using SolidOnDevices = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, SolidOnDevices, ::testing::Values("opengl", "vulkan"),
                         [](const auto& parameter) { return std::string(parameter.param); });

Scene solid_scene(const View& view, Wrap wrap, double relief_depth = 0.3) {
  return {.view = view,
          .relief_depth = relief_depth,
          .tiling = wrap == Wrap::repeat ? 2.0 : 1.0,
          .wrap = wrap,
          .width_px = 48,
          .height_px = 48};
}

std::vector<const Technique*> solid_techniques() {
  std::vector<const Technique*> list;
  for (const Technique& technique : techniques())
    if (technique.is_of_solids()) list.push_back(&technique);
  return list;
}

Settings long_settings(const Technique& technique) {
  Settings settings(technique);
  for (const std::string_view id : {"cone_steps", "node_steps", "linear_steps"})
    if (technique.find(id) != nullptr) settings.set(id, 2000);
  if (technique.find("filter") != nullptr) settings.set("filter", "manual");
  return settings;
}

struct SolidFrame {
  StoredMap map;
  std::vector<ScorePixel> pixels;
  std::vector<ReferenceHit> reference;
  JudgedFrame judged;
};
SolidFrame solid_frame(const Rig& rig, const Pipeline& pipeline, const Settings& settings, const Heightfield& heights,
                       const Scene& scene) {
  SolidFrame frame{.map = store_map(settings, heights, scene.wrap), .pixels = {}, .reference = {}, .judged = {}};
  frame.pixels = trace_frame(rig, pipeline, frame.map, scene, &settings);
  frame.reference = exact_hits(ReferenceTracer(frame.map.surface, scene.wrap), frame.pixels);
  frame.judged = judge(frame.pixels, frame.reference, heights.width, heights.height, true);
  return frame;
}

TEST_P(SolidOnDevices, guarantees_are_kept_on_every_solid_wrap_and_view) {
  on_every_device([](const Rig& rig) {
    std::int64_t unresolved = 0;
    std::int64_t rays = 0;
    std::int64_t passed = 0;
    struct Promise {
      std::string_view technique;
      std::vector<std::pair<std::string_view, std::string_view>> values;
    };
    const std::vector<Promise> promises{
        {"double_cone", {{"format", "r8+rgba8"}}},
        {"double_cone", {{"format", "r16+rgba16"}, {"encoding", "h_tan"}}},
        {"double_cone", {{"format", "r32f+rgba32f"}, {"encoding", "ratio"}}},
        {"double_cone", {{"format", "r16f+rgba16f"}, {"encoding", "ratio"}, {"max_ratio", "unbounded"}}},
        {"double_mip", {{"format", "rg8"}}},
        {"double_mip", {{"format", "rg32f"}}}};
    for (const Promise& promise : promises) {
      Settings settings = long_settings(find_technique(promise.technique));
      for (const auto& [id, text] : promise.values) settings.set(id, text);
      ASSERT_EQ(conflict(settings), "");
      ASSERT_EQ(guarantee_of(settings), Guarantee::exact) << settings.text();
      for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
        const auto pipeline = score_pipeline(rig, settings, wrap);
        for (const ProceduralRow& row : procedurals()) {
          if (!row.is_solid) continue;
          for (const View& view : view_presets()) {
            const SolidFrame frame =
                solid_frame(rig, *pipeline, settings, row.generate(29, 32, 7), solid_scene(view, wrap));
            rays += frame.judged.score.pixels;
            for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
              const ScorePixel& pixel = frame.pixels[i];
              passed += pixel.status == static_cast<float>(PixelStatus::passed) ? 1 : 0;
              ASSERT_NE(pixel.status, static_cast<float>(PixelStatus::step_cap))
                  << settings.text() << row.id << view.id;
              const Kept kept =
                  keeps(Guarantee::exact, pixel, frame.judged.pixels[i], frame.reference[i], frame.map.surface, wrap);
              ASSERT_NE(kept, Kept::no) << settings.text() << " on " << row.id << " at " << view.id << ", pixel " << i
                                        << ": status " << pixel.status << " t " << pixel.t << ", exact "
                                        << frame.reference[i].t_enter << " to " << frame.reference[i].t_exit << ", gap "
                                        << gap_above(frame.map.surface, wrap, pixel.ray, pixel.t);
              unresolved += kept == Kept::unresolved ? 1 : 0;
            }
          }
        }
      }
    }
    EXPECT_LE(static_cast<double>(unresolved), 1e-4 * static_cast<double>(rays));
    EXPECT_GT(passed, rays / 10);
    EXPECT_LT(passed, rays - rays / 10);
  });
}

TEST_P(SolidOnDevices, every_technique_shows_the_ball_and_what_is_beside_it) {
  on_every_device([](const Rig& rig) {
    const Heightfield ball = load_heightmap({.source = "ball", .width = 64, .height = 64});
    for (const Technique* technique : solid_techniques()) {
      const Settings settings = long_settings(*technique);
      const auto pipeline = score_pipeline(rig, settings, Wrap::clamp);
      for (const View& view : view_presets()) {
        const FrameScore score =
            solid_frame(rig, *pipeline, settings, ball, solid_scene(view, Wrap::clamp)).judged.score;
        // Linear steps pass the thin rim: a hundredth of the frame where the view is shallow.
        EXPECT_LE(score.at("coverage_error"), technique->guarantee == Guarantee::exact ? 0 : 0.01)
            << technique->id << " " << view.id;
        EXPECT_LT(score.at("e_z.p99"), 2e-3) << technique->id << " " << view.id;
      }
    }
  });
}

TEST_P(SolidOnDevices, where_there_is_nothing_all_rays_pass) {
  on_every_device([](const Rig& rig) {
    const Heightfield nothing = load_heightmap({.source = "nothing", .width = 32, .height = 32});
    Heightfield sheet = load_heightmap({.source = "fbm", .width = 32, .height = 32});
    sheet.floors = sheet.texels;
    for (const Heightfield* heights : {&nothing, &std::as_const(sheet)})
      for (const Technique* technique : solid_techniques()) {
        const Settings settings = long_settings(*technique);
        const auto pipeline = score_pipeline(rig, settings, Wrap::repeat);
        for (const View& view : view_presets())
          for (const ScorePixel& pixel :
               solid_frame(rig, *pipeline, settings, *heights, solid_scene(view, Wrap::repeat)).pixels) {
            if (pixel.status == static_cast<float>(PixelStatus::no_ray)) continue;
            ASSERT_EQ(pixel.status, static_cast<float>(PixelStatus::passed)) << technique->id << " " << view.id;
            ASSERT_EQ(pixel.t, 1) << technique->id;
          }
      }
  });
}

// What coverage_error is for: linear steps pass bars that are thinner than one.
TEST_P(SolidOnDevices, few_linear_steps_make_false_holes) {
  on_every_device([](const Rig& rig) {
    const Heightfield grille = load_heightmap({.source = "grille", .width = 64, .height = 64});
    const auto score_of = [&](const char* steps) {
      const Settings settings = settings_of("double_relief", {{"linear_steps", steps}, {"filter", "manual"}});
      return solid_frame(rig, *score_pipeline(rig, settings, Wrap::repeat), settings, grille,
                         solid_scene(view_presets()[2], Wrap::repeat))
          .judged.score;
    };
    const FrameScore few = score_of("4");
    EXPECT_GT(few.at("false_hole_rate"), 0.02);
    EXPECT_EQ(few.at("coverage_error"), few.at("false_hole_rate") + few.at("false_solid_rate"));
    EXPECT_LT(score_of("1000").at("coverage_error"), 0.2 * few.at("coverage_error"));
  });
}

// A technique of reliefs sees the upper surface and ends on the bottom plate: no hole is seen through it.
TEST_P(SolidOnDevices, a_relief_technique_fills_the_holes) {
  on_every_device([](const Rig& rig) {
    const Heightfield ball = load_heightmap({.source = "ball", .width = 64, .height = 64});
    const Settings settings = settings_of("relief", {{"linear_steps", "200"}, {"filter", "manual"}, {"format", "r16"}});
    const StoredMap map = store_map(settings, ball, Wrap::clamp);
    EXPECT_FALSE(map.surface.is_solid());
    const auto pixels = trace_frame(rig, settings, map, solid_scene(view_presets()[1], Wrap::clamp));
    const auto reference = exact_hits(ReferenceTracer(ball, Wrap::clamp), pixels);
    const FrameScore score = judge(pixels, reference, 64, 64, true).score;
    const auto passing = std::ranges::count_if(reference, &ReferenceHit::passes);
    EXPECT_GT(passing, 100);
    EXPECT_NEAR(score.at("false_solid_rate") * static_cast<double>(score.pixels), static_cast<double>(passing), 1e-6);
    EXPECT_EQ(score.at("false_hole_rate"), 0);
  });
}

TEST_P(SolidOnDevices, what_passes_is_shaded_as_the_sky) {
  on_every_device([](const Rig& rig) {
    const Heightfield ball = load_heightmap({.source = "ball", .width = 64, .height = 64});
    for (const Technique* technique : solid_techniques()) {
      const Settings settings = long_settings(*technique);
      const Scene scene = solid_scene(view_presets()[0], Wrap::clamp);
      const StoredMap map = store_map(settings, ball, scene.wrap);
      const auto pixels = trace_frame(rig, settings, map, scene);
      const auto pipeline = rig.pipeline(compile_fragment(technique->id, Target::color, rig.row.dialect, {}),
                                         Target::color, constants_of(&settings, scene.wrap));
      const auto relief = rig.backend->upload(texture_desc(map.textures.relief, scene.wrap));
      const auto extra =
          map.textures.extra ? rig.backend->upload(texture_desc(*map.textures.extra, scene.wrap)) : nullptr;
      const Draw draw{.pipeline = pipeline.get(),
                      .textures = rig.textures(relief.get(), extra.get()),
                      .frame = frame_uniforms(scene, ball.width, ball.height)};
      const std::vector<std::uint8_t> rgba8 = shade_frame(*rig.backend, std::span(&draw, 1));
      const auto color_of = [&](std::size_t i) { return std::array{rgba8[4 * i], rgba8[4 * i + 1], rgba8[4 * i + 2]}; };
      const std::array<std::uint8_t, 3> sky{140, 166, 204};
      std::size_t passed = 0;
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        const bool is_sky = pixels[i].status == static_cast<float>(PixelStatus::passed) ||
                            pixels[i].status == static_cast<float>(PixelStatus::no_ray);
        passed += pixels[i].status == static_cast<float>(PixelStatus::passed) ? 1 : 0;
        ASSERT_EQ(color_of(i) == sky, is_sky) << technique->id << " pixel " << i;
      }
      EXPECT_GT(passed, 100U);
    }
  });
}

TEST(SolidSettings, run_on_heightmaps_of_two_heights_alone) {
  for (const Technique& technique : techniques()) {
    const Settings settings(technique);
    EXPECT_EQ(heights_conflict(settings, false).empty(), !technique.is_of_solids()) << technique.id;
    EXPECT_EQ(heights_conflict(settings, true), "") << technique.id;
  }
  EXPECT_NE(heights_conflict(settings_of("cone", {{"shadow", "linear"}}), true), "");
  EXPECT_NE(heights_conflict(settings_of("relief", {{"depth", "write"}}), true), "");
  EXPECT_EQ(heights_conflict(settings_of("relief", {{"fade", "distance"}}), true), "");
  const Scene plane{.view = {}};
  const Scene sphere{.view = {}, .surface = {.kind = SurfaceKind::sphere}};
  EXPECT_EQ(conflict(settings_of("double_mip"), plane, true), "");
  EXPECT_THAT(conflict(settings_of("double_mip"), sphere, true), testing::HasSubstr("needs a plane, not a sphere"));
  EXPECT_THAT(conflict(settings_of("relief"), sphere, true), testing::HasSubstr("needs a plane, not a sphere"));
}

TEST(SolidSettings, need_a_format_with_room_for_two_heights) {
  EXPECT_NE(conflict(settings_of("double_relief", {{"format", "r16"}})), "");
  EXPECT_NE(conflict(settings_of("double_relief", {{"format", "rgba8"}})), "");
  EXPECT_EQ(conflict(settings_of("double_relief", {{"format", "r8+r8"}})), "");
  EXPECT_NE(conflict(settings_of("double_mip", {{"format", "r8+r8"}})), "");
  EXPECT_NE(conflict(settings_of("double_cone", {{"format", "rg16"}})), "");
  EXPECT_EQ(guarantee_of(settings_of("double_cone", {{"correction", "none"}})), Guarantee::none);
}

}  // namespace
}  // namespace reliefbench
