#include "backends/backend.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>

#include "tests/technique_rig.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class RealBackendTest : public BackendTest {};

TEST(BackendInterface, has_at_most_eight_virtual_functions) {
  std::ifstream in(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "backends/backend.h");
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const std::size_t from = text.find("\nclass Backend {");
  const std::string interface = text.substr(from, text.find("\n};", from) - from);
  int count = -1;  // but for the destructor
  for (std::size_t at = interface.find("virtual "); at != std::string::npos; at = interface.find("virtual ", at + 1))
    ++count;
  EXPECT_GT(count, 0);
  EXPECT_LE(count, 8);
}

TEST_P(BackendTest, a_device_describes_itself) {
  int index = 0;
  for (const DeviceInfo& device : row().devices()) {
    EXPECT_EQ(device.backend, row().id);
    EXPECT_EQ(device.index, index++);
    EXPECT_FALSE(device.name.empty());
    EXPECT_FALSE(device.driver.empty());
    EXPECT_FALSE(device.api_version.empty());
    EXPECT_THAT(device.type, ::testing::AnyOf("cpu", "integrated", "discrete", "virtual", "other"));
    ASSERT_FALSE(device.timers.empty());
    EXPECT_EQ(device.timers.front(), Timer::fenced_wall);
    EXPECT_EQ(row().open(device.index, {})->device().name, device.name);
  }
}

TEST_P(BackendTest, a_missing_device_is_an_environment_error_with_the_count) {
  const std::string count = std::to_string(row().devices().size());
  EXPECT_THAT(message_of([] { (void)row().open(99, {}); }), AllOf(HasSubstr("99"), HasSubstr(count)));
  EXPECT_THAT(message_of([] { (void)row().open(-1, {}); }), HasSubstr("-1"));
}

TEST_P(BackendTest, the_score_frame_of_flat_has_the_pixels_own_rays) {
  on_every_device([](Rig& rig) {
    const auto pipeline = rig.technique("flat", Target::score);
    for (const View& view : view_presets()) {
      Scene scene = kScene;
      scene.view = view;
      rig.draw(*pipeline, scene);
      const std::vector<ScorePixel> score = rig.backend->read_score();
      ASSERT_EQ(score.size(), 40u * 24u);
      const FrameUniforms frame = frame_uniforms(scene, 8, 8);
      for (int y = 0; y < scene.height_px; ++y)
        for (int x = 0; x < scene.width_px; ++x) {
          const ScorePixel& found = score[static_cast<std::size_t>(y * scene.width_px + x)];
          const ScorePixel expected = pixel_ray(frame, scene.wrap, x, y);
          ASSERT_EQ(found.status, expected.status) << view.id << " at " << x << "," << y;
          EXPECT_EQ(found.t, 0);
          EXPECT_EQ(found.taps, 0);
          EXPECT_EQ(found.steps, 0);
          // GPUs round the division and the dot products in their own way; near the horizon that is multiplied.
          const auto near = [&](float a, float b) {
            return std::abs(a - b) <= 1e-5F * (1 + std::abs(expected.ray.slope_u) + std::abs(expected.ray.slope_v)) *
                                          static_cast<float>(1 / scene.relief_depth);
          };
          EXPECT_TRUE(near(found.ray.slope_u, expected.ray.slope_u)) << view.id << " at " << x << "," << y;
          EXPECT_TRUE(near(found.ray.slope_v, expected.ray.slope_v)) << view.id << " at " << x << "," << y;
          // A ray that falls on a tile's edge may be counted to either tile.
          const auto near_modulo_1 = [&](float a, float b) { return near(a, b) || near(std::abs(a - b), 1); };
          EXPECT_TRUE(near_modulo_1(found.ray.u, expected.ray.u)) << view.id << " at " << x << "," << y;
          EXPECT_TRUE(near_modulo_1(found.ray.v, expected.ray.v)) << view.id << " at " << x << "," << y;
        }
    }
  });
}

// Wherever it lies in the relief, the polygon is seen where it is.
TEST_P(BackendTest, a_relief_about_the_plane_has_the_polygon_where_its_base_is) {
  on_every_device([](Rig& rig) {
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      const auto pipeline = score_pipeline(rig, settings_of("flat"), wrap);
      const auto map = rig.backend->upload(texture_desc(pack_heights(small_fbm(), find_format("r8")).relief, wrap));
      for (const View& view : view_presets())
        for (const double base : {0.0, 0.25, 0.5}) {
          Scene scene = kScene;
          scene.view = view;
          scene.wrap = wrap;
          scene.tiling = 2;
          const FrameUniforms on_top = frame_uniforms(scene, 8, 8);
          scene.base = base;
          rig.draw(*pipeline, scene, map.get());
          const std::vector<ScorePixel> score = rig.backend->read_score();
          for (int y = 0; y < scene.height_px; ++y)
            for (int x = 0; x < scene.width_px; ++x) {
              const ScorePixel& found = score[static_cast<std::size_t>(y * scene.width_px + x)];
              const ScorePixel polygon = pixel_ray(on_top, wrap, x, y);
              ASSERT_EQ(found.status, polygon.status) << view.id << " at " << x << "," << y;
              if (rig.row.real && static_cast<PixelStatus>(found.status) == PixelStatus::hit)
                EXPECT_NEAR(found.t, 1 - base, 1e-6) << view.id << " at " << x << "," << y;
              const auto same = [&](float u, float slope, float of_polygon) {
                const double apart = static_cast<double>(u + slope * static_cast<float>(1 - base) - of_polygon);
                return std::abs(apart - std::round(apart)) <= 1e-5 * (1 + std::abs(static_cast<double>(slope)) / 0.1);
              };
              EXPECT_TRUE(same(found.ray.u, found.ray.slope_u, polygon.ray.u)) << view.id << " at " << x << "," << y;
              EXPECT_TRUE(same(found.ray.v, found.ray.slope_v, polygon.ray.v)) << view.id << " at " << x << "," << y;
            }
        }
    }
  });
}

TEST_P(BackendTest, reading_before_drawing_is_an_error) {
  on_every_device([](Rig& rig) {
    EXPECT_THAT(message_of([&] { (void)rig.backend->read_score(); }), HasSubstr("attachment out_ray"));
    EXPECT_THAT(message_of([&] { (void)rig.backend->read_color(); }), HasSubstr("attachment out_color"));
  });
}

TEST_P(BackendTest, frames_take_the_size_of_the_draw) {
  on_every_device([](Rig& rig) {
    const auto score = rig.technique("flat", Target::score);
    const auto color = rig.technique("flat", Target::color);
    for (const auto& [width, height] : {std::pair{16, 16}, std::pair{64, 8}, std::pair{1, 1}, std::pair{64, 8}}) {
      Scene scene = kScene;
      scene.width_px = width;
      scene.height_px = height;
      rig.draw(*score, scene);
      rig.draw(*color, scene);
      const auto pixels = static_cast<std::size_t>(width * height);
      EXPECT_EQ(rig.backend->read_score().size(), pixels);
      EXPECT_EQ(rig.backend->read_color().size(), 4 * pixels);
    }
  });
}

TEST_P(BackendTest, score_and_color_frames_are_kept_apart) {
  on_every_device([](Rig& rig) {
    const auto score = rig.technique("flat", Target::score);
    const auto color = rig.technique("flat", Target::color);
    Scene large = kScene;
    large.width_px = 80;
    rig.draw(*score, kScene);
    rig.draw(*color, large);
    EXPECT_EQ(rig.backend->read_score().size(), 40u * 24u);
    EXPECT_EQ(rig.backend->read_color().size(), 80u * 24u * 4u);
  });
}

TEST_P(BackendTest, every_offered_timer_answers_and_no_other) {
  on_every_device([](Rig& rig) {
    const auto load = rig.pipeline(compile_load(rig.row.dialect), Target::color, {{.id = 0, .value = 256}}, "load");
    const Draw draw{.pipeline = load.get(), .textures = rig.textures(), .frame = frame_uniforms(kScene, 8, 8)};
    const std::vector<Timer>& offered = rig.backend->device().timers;
    for (const Timer timer : {Timer::fenced_wall, Timer::gl_time_elapsed, Timer::gl_timestamp, Timer::vk_timestamp}) {
      if (std::find(offered.begin(), offered.end(), timer) == offered.end()) {
        EXPECT_THAT(message_of([&] { (void)rig.backend->render(draw, 1, timer); }), HasSubstr(timer_id(timer)));
        continue;
      }
      const BatchTime time = rig.backend->render(draw, 3, timer);
      EXPECT_GT(time.wall_ns, 0);
      EXPECT_EQ(time.device_ns.has_value(), timer != Timer::fenced_wall) << timer_id(timer);
    }
  });
}

TEST_P(BackendTest, two_instances_take_turns) {
  on_every_device([](Rig& first) {
    Rig second(first.row, first.backend->device().index);
    const auto a = first.technique("flat", Target::score);
    const auto b = second.technique("flat", Target::score);
    Scene small = kScene;
    small.width_px = 8;
    first.draw(*a, kScene);
    second.draw(*b, small);
    EXPECT_EQ(first.backend->read_score().size(), 40u * 24u);
    EXPECT_EQ(second.backend->read_score().size(), 8u * 24u);
    {
      const Rig third(first.row, first.backend->device().index);  // one that ends leaves the others alone
    }
    first.draw(*a, small);
    EXPECT_EQ(first.backend->read_score().size(), 8u * 24u);
    EXPECT_THAT(second.backend->debug_messages(), IsEmpty());
  });
}

TEST_P(RealBackendTest, the_load_shader_computes_its_chain) {
  on_every_device([](Rig& rig) {
    const auto load = rig.pipeline(compile_load(rig.row.dialect), Target::color, {{.id = 0, .value = 2}}, "load");
    rig.draw(*load, kScene);
    const std::vector<std::uint8_t> color = rig.backend->read_color();
    for (const auto& [x, y] : {std::pair{0, 0}, std::pair{39, 0}, std::pair{7, 23}}) {
      const double seed = (x + 0.5) * 0.0137 + (y + 0.5) * 0.0071;
      double value = (seed - std::floor(seed)) * 0.8 + 0.1;
      for (int i = 0; i < 2; ++i) value = 3.9 * value * (1 - value);
      const std::size_t at = static_cast<std::size_t>(y * kScene.width_px + x) * 4;
      EXPECT_NEAR(color[at], 255 * value, 1.01) << x << "," << y;
      EXPECT_EQ(color[at + 3], 255);
    }
  });
}

TEST_P(RealBackendTest, the_shaded_frame_of_flat_is_opaque_and_not_empty) {
  on_every_device([](Rig& rig) {
    rig.draw(*rig.technique("flat", Target::color), kScene);
    const std::vector<std::uint8_t> color = rig.backend->read_color();
    for (std::size_t i = 0; i < color.size(); i += 4) ASSERT_EQ(color[i + 3], 255);
    EXPECT_GT(std::accumulate(color.begin(), color.end(), 0L), 255L * 40 * 24);
  });
}

TEST_P(RealBackendTest, constants_that_a_module_lacks_are_ignored) {
  on_every_device([](Rig& rig) {
    const Spirv fragment = compile_load(rig.row.dialect);
    const auto with = rig.pipeline(fragment, Target::color, {{.id = 77, .value = 1}, {.id = 0, .value = 3}});
    const auto without = rig.pipeline(fragment, Target::color, {{.id = 0, .value = 3}});
    rig.draw(*with, kScene);
    const std::vector<std::uint8_t> color = rig.backend->read_color();
    rig.draw(*without, kScene);
    EXPECT_EQ(color, rig.backend->read_color());
  });
}

TEST_P(RealBackendTest, a_broken_module_is_an_environment_error) {
  on_every_device([](Rig& rig) {
    const Spirv good = compile_load(rig.row.dialect);
    const Spirv no_magic(64, 0x12345678);
    const Spirv cut(good.begin(), good.end() - 2);
    for (const Spirv& bad : {Spirv{}, no_magic, cut})
      EXPECT_THAT(message_of([&] { (void)rig.pipeline(bad, Target::color); }), HasSubstr("SPIR-V"));
    rig.draw(*rig.pipeline(good, Target::color), kScene);  // and it still works
  });
}

INSTANTIATE_TEST_SUITE_P(backends, BackendTest, ::testing::Values("opengl", "vulkan", "null"), backend_name);
INSTANTIATE_TEST_SUITE_P(backends, RealBackendTest, ::testing::Values("opengl", "vulkan"), backend_name);

}  // namespace
}  // namespace reliefbench
