#include <algorithm>
#include <chrono>

#include "kernels/maps/texel.h"
#include "tests/backend_rig.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

TEST(NullBackend, times_repeat_and_grow_with_the_steps) {
  const auto times = [] {
    const Rig rig(find_backend("null"), 0);
    std::vector<double> result;
    for (const int steps : {8, 16, 32}) {
      const auto pipeline = rig.pipeline({}, Target::color, {{.id = 16, .value = steps}}, "relief");
      const Draw draw{.pipeline = pipeline.get(), .textures = rig.textures(), .frame = frame_uniforms(kScene, 8, 8)};
      result.push_back(rig.backend->render(draw, 4, Timer::fenced_wall).wall_ns);
    }
    return result;
  };
  EXPECT_EQ(times(), times());
  const std::vector<double> first = times();
  EXPECT_LT(first[0] * 1.2, first[1]);
  EXPECT_LT(first[1] * 1.2, first[2]);
}

TEST(NullBackend, the_load_doubles_with_its_length) {
  const Rig rig(find_backend("null"), 0);
  const auto time = [&](int steps) {
    const auto load = rig.pipeline({}, Target::color, {{.id = 0, .value = steps}}, "load");
    const Draw draw{.pipeline = load.get(), .textures = rig.textures(), .frame = frame_uniforms(kScene, 8, 8)};
    return rig.backend->render(draw, 1, Timer::fenced_wall).wall_ns;
  };
  EXPECT_NEAR(time(128) / time(64), 2, 0.05);
}

TEST(NullBackend, hits_come_nearer_with_more_steps) {
  const Rig rig(find_backend("null"), 0);
  const std::vector<float> half_way(64, 0.5F);
  const auto relief = rig.backend->upload({.width = 8,
                                           .height = 8,
                                           .layout = {.type = TexelType::float32, .channels = 1},
                                           .texels = std::as_bytes(std::span(half_way))});
  const auto first_t = [&](int steps) {
    const auto pipeline = rig.pipeline({}, Target::score, {{.id = 16, .value = steps}}, "relief");
    rig.draw(*pipeline, kScene, relief.get());
    return rig.backend->read_score().back().t;
  };
  // The exact hit of a plane half way down is t = 1/2.
  EXPECT_NEAR(first_t(1), 0.25, 1e-6);
  EXPECT_NEAR(first_t(999), 0.4995, 1e-6);
}

TEST(NullBackend, the_failing_device_refuses_one_technique) {
  const Rig rig(find_backend("null"), 1);
  EXPECT_THAT(message_of([&] { (void)rig.pipeline({}, Target::color, {}, "relaxed_cone"); }),
              HasSubstr("relaxed_cone"));
  EXPECT_NE(rig.pipeline({}, Target::color, {}, "relief"), nullptr);
  EXPECT_NE(Rig(find_backend("null"), 0).pipeline({}, Target::color, {}, "relaxed_cone"), nullptr);
}

TEST(NullBackend, the_waiting_device_lets_the_time_pass_that_it_tells_of) {
  const Rig rig(find_backend("null"), 2);
  const auto flat = rig.pipeline({}, Target::color, {}, "flat");
  const Draw draw{.pipeline = flat.get(), .textures = rig.textures(), .frame = frame_uniforms(kScene, 8, 8)};
  const auto from = std::chrono::steady_clock::now();
  const double told_ns = rig.backend->render(draw, 300'000, Timer::fenced_wall).wall_ns;
  EXPECT_GT(told_ns, 1e6);
  EXPECT_GE((std::chrono::steady_clock::now() - from).count(), told_ns);
}

}  // namespace
}  // namespace reliefbench
