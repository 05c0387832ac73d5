// The feature `depth`: what frames that hold other objects write, and what is seen in them.
#include "kernels/trace/depth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "kernels/image/heightmap.h"
#include "kernels/judge/depth_range.h"
#include "kernels/judge/score.h"
#include "kernels/trace/surface.h"
#include "tests/export_rig.h"
#include "tests/technique_rig.h"
#include "tuner/measure/frame_draws.h"
#include "tuner/measure/session.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

using DepthTest = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, DepthTest, ::testing::Values("opengl", "vulkan"), backend_name);

Heightfield constant(float height) { return {.width = 8, .height = 8, .texels = std::vector<float>(64, height)}; }

/// From 0 on its left to 1 on its right, clamped.
Heightfield ramp(int width) {
  Heightfield map{.width = width, .height = 4, .texels = {}};
  for (int i = 0; i < 4 * width; ++i)
    map.texels.push_back(static_cast<float>(i % width) / static_cast<float>(width - 1));
  return map;
}

Scene depth_scene(const View& view, double relief_depth = 0.2) {
  return {.view = view, .relief_depth = relief_depth, .width_px = 64, .height_px = 48};
}

std::vector<View> extreme_views() {
  std::vector<View> views(view_presets().begin(), view_presets().end());
  views.push_back({.id = "grazing_0.1", .elevation_deg = 0.1, .distance = 20, .fov_deg = 0.1});
  views.push_back({.id = "touching", .elevation_deg = 1e-6, .distance = 1, .fov_deg = 90});
  views.push_back({.id = "wide", .elevation_deg = 2, .distance = 3, .fov_deg = 120});
  views.push_back({.id = "before", .elevation_deg = 5, .distance = 1, .fov_deg = 90});
  views.push_back({.id = "inside", .elevation_deg = -2, .distance = 0.5, .fov_deg = 60});
  return views;
}

/// Whole frames of a session, as sweeps draw them.
struct DepthRig {
  explicit DepthRig(const BackendRow& row, int device = 0)
      : session(row, device, split, {.audits = Audits::none, .open = open_debug}) {}

  struct Drawn {
    std::vector<std::uint8_t> rgba8;
    std::vector<float> depths;  ///< empty where the frame has none
  };
  Drawn draw(const Settings& settings, const Heightfield& heights, const Scene& scene) {
    const UploadedScene uploaded = upload(session.backend(), scene, heights);
    const BakedMap map = bake(bake_spec(settings, scene.wrap), heights);
    const Frame frame = upload(session.backend(), pack(settings, map, scene), uploaded);
    const std::vector<Draw> draws = shaded_draws(session, settings, scene, frame.draw);
    Drawn drawn{.rgba8 = shade_frame(session.backend(), draws), .depths = {}};
    if (color_target(pixel_features(settings), scene.occluded > 0).has_depth) drawn.depths = depths();
    return drawn;
  }
  std::vector<float> depths() {
    const std::span<const std::uint8_t> bytes = session.backend().read("depth");
    std::vector<float> values(bytes.size() / sizeof(float));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }

  WallSplit split;
  Session session;
};

template <typename Body>
void on_every_session(const BackendRow& row, const Body& body) {
  for (const DeviceInfo& device : row.devices()) {
    SCOPED_TRACE(device.name);
    DepthRig rig(row, device.index);
    body(rig);
    EXPECT_THAT(rig.session.backend().debug_messages(), ::testing::IsEmpty());
  }
}

SeenObject seen_in(const std::vector<std::uint8_t>& rgba8, std::size_t pixel) {
  return SeenObject{rgba8[4 * pixel + 3]};
}

/// Exact hits in full precision.
Settings exact_settings(std::string_view depth) {
  return settings_of("max_mip", {{"format", "r32f"}, {"node_steps", "2000"}, {"depth", depth}});
}

// What a depth buffer holds is known where the surface is: a constant height is a plane.
TEST(Depth, of_a_plane_is_known) {
  const Scene scene = depth_scene(View{.id = "down", .elevation_deg = 90, .distance = 2, .fov_deg = 20});
  const FrameUniforms frame = frame_uniforms(scene, 8, 8);
  const double near = 2 * kNearPlane;
  for (const double t : {0.0, 0.5, 1.0}) {
    const std::vector<ReferenceHit> hits(64 * 48, ReferenceHit{.t_enter = t, .t_exit = 1});
    const double expected = (1 - near / (2 + 0.2 * t)) * kDepthRange / (kDepthRange - 1);
    for (const float depth : exact_depth(frame, Wrap::repeat, hits)) ASSERT_NEAR(depth, expected, 1e-7) << t;
  }
}

TEST(Depth, is_clamped_at_both_planes) {
  const FrameUniforms frame = frame_uniforms(depth_scene(view_presets()[1]), 8, 8);
  const auto near = static_cast<double>(frame.up[3]);
  EXPECT_EQ(window_depth(frame, -1), 0);
  EXPECT_EQ(window_depth(frame, near), 0);
  EXPECT_NEAR(window_depth(frame, 2 * near), 0.5 * kDepthRange / (kDepthRange - 1), 1e-12);
  EXPECT_EQ(window_depth(frame, kDepthRange * near * 2), static_cast<double>(kFarthest));
}

TEST(Depth, its_error_is_a_share_of_the_distance) {
  const FrameUniforms frame = frame_uniforms(depth_scene(view_presets()[1]), 8, 8);
  const auto error = [&](double found, double exact) {
    return depth_error(static_cast<float>(window_depth(frame, found)), static_cast<float>(window_depth(frame, exact)));
  };
  EXPECT_NEAR(error(1.1, 1.0), 0.1, 1e-5);
  EXPECT_NEAR(error(0.9, 1.0), 0.1, 1e-5);
  EXPECT_EQ(error(3, 3), 0);
}

// The ball and the square against a march along the ray in small steps.
TEST(Depth, the_objects_stand_where_a_slow_march_finds_them) {
  const Scene scene = depth_scene(view_presets()[1]);
  const FrameUniforms frame = frame_uniforms(scene, 8, 8);
  const std::vector<ReferenceHit> bottom(64 * 48, ReferenceHit{.t_enter = 1, .t_exit = 1});
  const std::vector<SeenObject> seen = exact_visibility(frame, Wrap::repeat, bottom);
  std::size_t differing = 0;
  std::size_t objects = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const double right = (x + 0.5) / 64 * 2 - 1;
      const double down = (y + 0.5) / 48 * 2 - 1;
      std::array<double, 3> d{};
      for (std::size_t i = 0; i < 3; ++i)
        d.at(i) = frame.forward.at(i) + frame.right.at(i) * right - frame.up.at(i) * down;
      SeenObject first = SeenObject::relief;
      double last_side = 0;
      for (double s = 0.5; s < 4 && first == SeenObject::relief; s += 0.0005) {
        const double px = frame.position[0] + d[0] * s;
        const double py = frame.position[1] + d[1] * s;
        const double pz = frame.position[2] + d[2] * s;
        if (pz < -0.2) break;  // the bottom plate
        if (std::hypot(px - 0.7, py - 0.5, pz + 0.1) < kBallRadius) first = SeenObject::ball;
        // From the bottom at 0.25 left of its middle to the top at 0.25 right of it; its middle is at 0 on the left.
        const double side = pz - (-0.1 + (px - 0.0) * 0.4);
        if (last_side * side < 0 && std::abs(px) <= 0.25 && std::abs(py - 0.5) <= 0.25) first = SeenObject::square;
        last_side = side;
      }
      const SeenObject exact = seen[static_cast<std::size_t>(64 * y + x)];
      differing += first == exact ? 0U : 1U;
      objects += exact == SeenObject::relief ? 0U : 1U;
    }
  EXPECT_GT(objects, 300U);
  EXPECT_LE(differing, 20U);  // edges
}

// Every row's depth is the hit's own, at both planes, where the camera touches the plate, and at grazing angles.
TEST_P(DepthTest, is_the_hits_own_within_what_its_row_says) {
  on_every_device([](const Rig& rig) {
    for (const std::string_view row : {"write", "conservative"})
      for (const double relief_depth : {0.0, 0.1, 2.0})
        for (const View& view : extreme_views()) {
          const Scene scene = depth_scene(view, relief_depth);
          const Settings settings = settings_of("relief", {{"depth", row}});
          ASSERT_EQ(guarantee_of(settings, Query::depth), Guarantee::exact);
          const StoredMap map = store_map(settings, small_fbm(), scene.wrap);
          const std::vector<ScorePixel> pixels = trace_frame(rig, settings, map, scene);
          const std::vector<float> depths = rig.backend->read_values(pixel_features(settings)).front();
          const FrameUniforms frame = frame_uniforms(scene, 32, 32);
          EXPECT_EQ(wrong_depths(frame, scene.wrap, pixels, depths), 0) << row << " " << view.id << " " << relief_depth;
          std::vector<float> off = depths;
          for (float& depth : off) depth += 0.01F;
          if (view.id == "oblique") {
            EXPECT_GT(wrong_depths(frame, scene.wrap, pixels, off), 1000);
          }
        }
  });
}

// Where rays graze a torus, what counts is how near to it they are followed: of a wide and of a narrow tube.
TEST_P(DepthTest, of_a_curved_surface_is_the_hits_own) {
  on_every_device([](const Rig& rig) {
    for (const SurfaceKind kind : {SurfaceKind::cylinder, SurfaceKind::sphere, SurfaceKind::torus})
      for (const bool is_wide : {false, true}) {
        Scene scene = depth_scene({.id = "round",
                                   .elevation_deg = is_wide ? 38.0 : 10.0,
                                   .distance = is_wide ? 1.0 : 1.4,
                                   .fov_deg = 30,
                                   .azimuth_deg = 20},
                                  0.03);
        scene.width_px = scene.height_px = 96;
        scene.surface = {.kind = kind, .tube = is_wide ? 1.9 : 1.0};
        const Settings settings = settings_of("max_mip", {{"depth", "write"}});
        const StoredMap map = store_map(settings, small_fbm(), scene.wrap);
        const std::vector<ScorePixel> pixels = trace_frame(rig, settings, map, scene);
        std::vector<float> depths = rig.backend->read_values(pixel_features(settings)).front();
        const FrameUniforms frame = frame_uniforms(scene, 32, 32);
        EXPECT_EQ(wrong_depths(frame, scene.wrap, pixels, depths), 0) << surface_row(kind).id << is_wide;
        for (float& depth : depths) depth += 1e-4F;
        EXPECT_GT(wrong_depths(frame, scene.wrap, pixels, depths), 1000) << surface_row(kind).id << is_wide;
      }
  });
}

TEST_P(DepthTest, of_a_flat_relief_is_the_plates) {
  on_every_session(row(), [](DepthRig& rig) {
    const Scene scene = depth_scene(view_presets()[1]);
    const DepthRig::Drawn plate = rig.draw(exact_settings("none"), constant(1), scene);
    EXPECT_TRUE(plate.depths.empty());
    const FrameUniforms frame = frame_uniforms(scene, 8, 8);
    const std::vector<ReferenceHit> hits(64 * 48, ReferenceHit{.t_enter = 0, .t_exit = 1});
    const std::vector<float> exact = exact_depth(frame, Wrap::repeat, hits);
    for (const std::string_view row : {"write", "conservative", "rtm"}) {
      const DepthRig::Drawn drawn = rig.draw(exact_settings(row), constant(1), scene);
      int relief = 0;
      for (std::size_t i = 0; i < exact.size(); ++i) {
        if (seen_in(drawn.rgba8, i) != SeenObject::relief) continue;
        ++relief;
        ASSERT_NEAR(drawn.depths[i], exact[i], 4e-7) << row;
      }
      EXPECT_GT(relief, 1000) << row;
    }
  });
}

// The tilted square goes from the bottom plate to the top one, so that in a ramp along it, or a constant relief, the
// cut is a straight line whose place is known.
TEST_P(DepthTest, the_cut_through_a_constant_relief_is_a_line) {
  on_every_session(row(), [](DepthRig& rig) {
    Scene scene = depth_scene(View{.id = "down", .elevation_deg = 90, .distance = 2, .fov_deg = 40}, 0.2);
    scene.width_px = scene.height_px = 128;
    for (const float height : {0.25F, 0.5F, 0.75F}) {
      const DepthRig::Drawn drawn = rig.draw(exact_settings("write"), constant(height), scene);
      // From above the square is seen where it is over the relief: right of x = (height - 1/2) * its side.
      const double cut = (height - 0.5) * kSquareSide;
      for (int x = 0; x < 128; ++x) {
        const double place =
            ((x + 0.5) / 64 - 1) * std::tan(20 * M_PI / 180) * (2 + 0.2 * (1 - static_cast<double>(height))) + 0.5;
        if (std::abs(place) > 0.23 || std::abs(place - cut) < 0.01) continue;
        const SeenObject seen = seen_in(drawn.rgba8, static_cast<std::size_t>(64 * 128 + x));
        EXPECT_EQ(seen, place > cut ? SeenObject::square : SeenObject::relief) << height << " " << place;
      }
    }
  });
}

TEST_P(DepthTest, what_is_seen_is_the_references) {
  on_every_session(row(), [](DepthRig& rig) {
    for (const View& view : view_presets())
      for (const Heightfield& heights : {small_fbm(), ramp(16)}) {
        const Scene scene = depth_scene(view);
        const FrameUniforms frame = frame_uniforms(scene, heights.width, heights.height);
        std::vector<ScorePixel> rays;
        for (int y = 0; y < 48; ++y)
          for (int x = 0; x < 64; ++x) rays.push_back(pixel_ray(frame, scene.wrap, x, y));
        const std::vector<SeenObject> exact =
            exact_visibility(frame, scene.wrap, exact_hits(ReferenceTracer(heights, scene.wrap), rays));
        const DepthRig::Drawn drawn = rig.draw(exact_settings("write"), heights, scene);
        int wrong = 0;
        for (std::size_t i = 0; i < exact.size(); ++i) {
          const bool has_ray = rays[i].status != static_cast<float>(PixelStatus::no_ray);
          wrong += has_ray && seen_in(drawn.rgba8, i) != exact[i] ? 1 : 0;
        }
        EXPECT_LE(wrong, 6) << view.id;  // of 3072: where two depths are the same floats
      }
  });
}

// Nothing that is seen is rejected: to the bit the frames that reject nothing.
TEST_P(DepthTest, conservative_frames_are_the_same) {
  on_every_session(row(), [](DepthRig& rig) {
    for (const View& view : extreme_views())
      for (const double relief_depth : {0.0, 0.1, 2.0})
        for (const double occluded : {0.0, 0.5}) {
          Scene scene = depth_scene(view, relief_depth);
          scene.occluded = occluded;
          const Settings write = settings_of("relief", {{"depth", "write"}});
          const Settings conservative = settings_of("relief", {{"depth", "conservative"}});
          const DepthRig::Drawn expected = rig.draw(write, small_fbm(), scene);
          const DepthRig::Drawn drawn = rig.draw(conservative, small_fbm(), scene);
          EXPECT_EQ(drawn.rgba8, expected.rgba8) << view.id << " " << relief_depth;
          EXPECT_EQ(drawn.depths, expected.depths) << view.id << " " << relief_depth;
        }
  });
}

// Whole frames of passes are those of the loop, whatever the depth test has to do with it.
TEST_P(DepthTest, passes_are_the_loop_in_every_frame) {
  on_every_session(row(), [](DepthRig& rig) {
    for (const std::string_view depth : {"none", "write", "conservative"})
      for (const double occluded : {0.0, 0.5}) {
        Scene scene = depth_scene(view_presets()[1]);
        scene.occluded = occluded;
        const DepthRig::Drawn loop = rig.draw(
            settings_of("depth_slices", {{"slices", "24"}, {"loop", "fixed"}, {"depth", depth}}), small_fbm(), scene);
        const DepthRig::Drawn passes =
            rig.draw(settings_of("depth_passes", {{"passes", "24"}, {"depth", depth}}), small_fbm(), scene);
        EXPECT_EQ(passes.rgba8, loop.rgba8) << depth << " " << occluded;
        EXPECT_EQ(passes.depths, loop.depths) << depth << " " << occluded;
      }
  });
}

TEST_P(DepthTest, a_part_of_the_frame_is_hidden) {
  on_every_session(row(), [](DepthRig& rig) {
    Scene scene = depth_scene(view_presets()[1]);
    scene.occluded = 0.25;
    for (const std::string_view row : {"none", "write", "conservative", "rtm"}) {
      const DepthRig::Drawn drawn = rig.draw(exact_settings(row), small_fbm(), scene);
      for (std::size_t i = 0; i < 64UL * 48; ++i) {
        const bool is_hidden = i % 64 < 16;
        ASSERT_EQ(seen_in(drawn.rgba8, i) == SeenObject::occluder, is_hidden) << row << " " << i;
      }
    }
  });
}

TEST(Depth, is_in_ids_and_in_exports_only_where_it_is_chosen) {
  EXPECT_THAT(settings_of("cone").text(), Not(HasSubstr("depth=")));
  EXPECT_THAT(settings_of("cone", {{"depth", "write"}}).text(), HasSubstr("&depth=write"));
  const auto library = [](const char* id) { return find_language("glsl").write(ShippedCase(id).shader()); };
  EXPECT_THAT(library("relief").library, Not(HasSubstr("relief_window_depth")));
  for (const auto& [id, written] :
       {std::pair("relief?depth=write", "surface.depth"), std::pair("relief?depth=rtm", "surface.depth"),
        std::pair("relief?depth=conservative", "max(surface.depth, gl_FragCoord.z)")}) {
    const ShippedText text = library(id);
    for (const char* words :
         {"relief_window_depth(", "const vec2 planes, const vec2 eye_depth)", "float depth;  // what"})
      EXPECT_THAT(text.library, HasSubstr(words)) << id;
    EXPECT_THAT(text.library, Not(HasSubstr("gl_FragDepth"))) << id;
    EXPECT_THAT(text.example, HasSubstr(fmt::format("gl_FragDepth = {};", written))) << id;
    for (const Dialect dialect : {Dialect::vulkan, Dialect::opengl})
      EXPECT_FALSE(compile_whole_fragment({.name = id, .text = text.example}, dialect).empty());
  }
}

}  // namespace
}  // namespace reliefbench
