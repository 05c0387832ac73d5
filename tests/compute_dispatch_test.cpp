// dispatch=compute: the same frames as fragments draw, put by a compute shader.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/cli_rig.h"
#include "tests/technique_rig.h"
#include "tuner/measure/frame_draws.h"
#include "tuner/measure/map_library.h"
#include "tuner/measure/session.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

using Values = std::vector<std::pair<std::string_view, std::string_view>>;

Settings by_compute(Settings settings) {
  settings.set("dispatch", "compute");
  return settings;
}

/// A frame whose sides no group divides.
Scene odd_scene() {
  Scene scene = kScene;
  scene.width_px = 53;
  scene.height_px = 27;
  return scene;
}

struct DispatchedFrame {
  std::vector<ScorePixel> pixels;
  FeatureValues values;
  std::vector<std::uint8_t> picture;
};

class DispatchedScene {
 public:
  DispatchedScene(std::string_view backend, const SceneSpec& spec)
      : spec_(spec), session_(find_backend(backend), 0, split_, {.audits = Audits::none, .open = open_debug}) {}

  [[nodiscard]] DispatchedFrame frame(const Settings& settings) {
    Backend& backend = session_.backend();
    const UploadedScene scene = upload(backend, spec_.scene, library_.heights(spec_));
    const Frame frame = upload(backend, library_.packed(settings, spec_), scene);
    DispatchedFrame made;
    made.pixels = trace_frame(backend, scored_draws(session_, settings, spec_.scene, frame.draw));
    made.values = backend.read_values(pixel_features(settings));
    draw_picture(session_, settings, spec_.scene, frame.draw, made.picture);
    return made;
  }
  [[nodiscard]] std::vector<std::string> complaints() { return session_.backend().debug_messages(); }

 private:
  SceneSpec spec_;
  WallSplit split_;
  Cache cache_ = Cache::open();
  MapLibrary library_{cache_, split_};
  Session session_;
};

SceneSpec small_spec(std::string_view source, const Scene& scene) {
  return {.id = fmt::format("{}/test", source),
          .heightmap = {.source = std::string(source), .width = 32, .height = 32},
          .scene = scene};
}

/// Share of pixels whose hit, values or color is another one.
double share_of_others(const DispatchedFrame& a, const DispatchedFrame& b) {
  EXPECT_EQ(a.pixels.size(), b.pixels.size());
  EXPECT_EQ(a.picture.size(), b.picture.size());
  double others = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const auto is_near = [](float x, float y) { return std::abs(x - y) <= 1e-5F; };
    bool is_same = a.pixels[i].status == b.pixels[i].status && is_near(a.pixels[i].t, b.pixels[i].t) &&
                   is_near(a.pixels[i].ray.u, b.pixels[i].ray.u);
    for (std::size_t j = 0; j < a.values.size(); ++j) is_same = is_same && is_near(a.values[j][i], b.values[j][i]);
    for (std::size_t j = 4 * i; j < 4 * i + 4; ++j) is_same = is_same && std::abs(a.picture[j] - b.picture[j]) <= 1;
    others += is_same ? 0 : 1;
  }
  return others / static_cast<double>(a.pixels.size());
}

class ComputeDispatch : public BackendTest {};

TEST_P(ComputeDispatch, makes_every_techniques_frame) {
  DispatchedScene relief(GetParam(), small_spec("bricks", odd_scene()));
  DispatchedScene solid(GetParam(), small_spec("grille", odd_scene()));
  std::size_t number = 0;
  for (const Technique& technique : techniques()) {
    if (!technique.passes.empty() || !is_turn(number++, row().id == "opengl")) continue;
    SCOPED_TRACE(technique.id);
    const Settings settings = settings_of(technique.id);
    DispatchedScene& seen = technique.is_of_solids() ? solid : relief;
    const DispatchedFrame drawn = seen.frame(settings);
    EXPECT_LE(share_of_others(drawn, seen.frame(by_compute(settings))), technique.disagreement);
    EXPECT_TRUE(std::ranges::any_of(drawn.pixels, [](const ScorePixel& pixel) { return pixel.t > 0; }) ||
                technique.id == "flat");
  }
  EXPECT_THAT(relief.complaints(), IsEmpty());
  EXPECT_THAT(solid.complaints(), IsEmpty());
}

TEST_P(ComputeDispatch, makes_what_a_scene_shows) {
  Scene clamped = odd_scene();
  clamped.wrap = Wrap::clamp;
  Scene ball = odd_scene();
  ball.surface.kind = SurfaceKind::sphere;
  const std::vector<std::tuple<std::string_view, Values, Scene>> cases{
      {"cone", {{"shadow", "cone"}, {"lod", "footprint"}}, odd_scene()},
      {"relief", {{"normals", "footprint"}, {"fade", "distance"}}, clamped},
      {"relief", {{"linear_steps", "5"}, {"dither", "temporal"}}, odd_scene()},
      {"cone", {{"silhouette", "quadric"}, {"shadow", "soft_taps"}}, ball},
  };
  for (const auto& [technique, values, scene] : cases) {
    SCOPED_TRACE(technique);
    const Settings settings = settings_of(technique, values);
    DispatchedScene seen(GetParam(), small_spec("bricks", scene));
    EXPECT_LE(share_of_others(seen.frame(settings), seen.frame(by_compute(settings))), 0.02);
    EXPECT_THAT(seen.complaints(), IsEmpty());
  }
}

// The frame before it, of another size or by fragments, leaves nothing behind.
TEST_P(ComputeDispatch, takes_turns_with_draws_and_sizes) {
  on_every_device([&](const Rig& rig) {
    Target put = Target::color;
    put.by_compute = true;
    const auto drawn = rig.technique("flat", Target::color);
    const auto dispatched = rig.technique("flat", put);
    Scene small = odd_scene();
    small.width_px = 9;
    std::vector<std::vector<std::uint8_t>> pictures;
    for (const Scene& scene : {odd_scene(), small, odd_scene()})
      for (const Pipeline* pipeline : {drawn.get(), dispatched.get()}) {
        rig.draw(*pipeline, scene);
        pictures.push_back(rig.backend->read_color());
        EXPECT_EQ(pictures.back().size(), static_cast<std::size_t>(4 * scene.width_px * scene.height_px));
      }
    for (std::size_t i = 0; i < pictures.size(); i += 2) EXPECT_EQ(pictures[i], pictures[i + 1]);
    EXPECT_EQ(pictures[0], pictures[4]);

    const FrameUniforms frame = frame_uniforms(small, 8, 8);
    const std::array mixed{Draw{.pipeline = drawn.get(), .textures = rig.textures(), .frame = frame},
                           Draw{.pipeline = dispatched.get(), .textures = rig.textures(), .frame = frame}};
    EXPECT_THAT(message_of([&] { rig.backend->render(mixed, 1, Timer::fenced_wall); }), HasSubstr("different targets"));
    rig.backend->render(std::array{mixed[1], mixed[1]}, 70, Timer::fenced_wall);
    EXPECT_EQ(rig.backend->read_color(), pictures[2]);
  });
}

TEST_P(ComputeDispatch, a_shader_must_have_what_its_target_has) {
  on_every_device([&](const Rig& rig) {
    Target color = Target::color;
    color.by_compute = true;
    Target score = Target::score;
    score.by_compute = true;
    const auto refusal = [&](const Target& of_shader, const Target& target) {
      const Spirv shader = compile_fragment("flat", of_shader, rig.row.dialect);
      return message_of([&] { static_cast<void>(rig.pipeline(shader, target)); });
    };
    EXPECT_THAT(refusal(color, score), HasSubstr("no image `out_ray`"));
    EXPECT_THAT(refusal(score, color), HasSubstr("no image `out_color`"));
    EXPECT_THAT(refusal(Target::color, color), HasSubstr("no compute shader"));
    Target deep = color;
    deep.has_depth = true;
    EXPECT_THAT(refusal(color, deep), HasSubstr("no compute shader has depth"));
  });
}

INSTANTIATE_TEST_SUITE_P(Backends, ComputeDispatch, ::testing::Values("opengl", "vulkan"), backend_name);

TEST(ComputeShader, says_its_images_and_its_group) {
  for (const Dialect dialect : {Dialect::opengl, Dialect::vulkan}) {
    Target score = Target::score;
    score.by_compute = true;
    const ShaderInterface shader = reflect(compile_fragment("relief", score, dialect));
    EXPECT_THAT(shader.group, ElementsAre(8U, 8U, 1U));
    EXPECT_THAT(shader.outputs, IsEmpty());
    ASSERT_EQ(shader.images.size(), 2U);
    EXPECT_EQ(shader.images[0].name, "out_ray");
    EXPECT_EQ(shader.images[1].name, "out_hit");
    EXPECT_EQ(shader.samplers.size(), 1U);
    const FrameUniforms frame = frame_uniforms(odd_scene(), 8, 8);
    EXPECT_THAT(groups_of(shader, frame), ElementsAre(7U, 4U));
  }
}

TEST(ComputeShader, has_no_say_where_fragments_are_needed) {
  const auto reason = [](std::string_view technique, const Values& values, const Scene& scene = kScene) {
    return conflict(by_compute(settings_of(technique, values)), scene, false);
  };
  EXPECT_EQ(reason("cone", {{"shadow", "cone"}}), "");
  EXPECT_EQ(reason("flat", {}), "");
  EXPECT_THAT(reason("depth_passes", {}), HasSubstr("whose passes are draws"));
  EXPECT_THAT(reason("cone", {{"normals", "gradient"}}), HasSubstr("derivatives are fragments' alone"));
  EXPECT_THAT(reason("cone", {{"depth", "write"}}), HasSubstr("no depth buffer, which depth=write writes"));
  Scene hidden = kScene;
  hidden.occluded = 0.5;
  EXPECT_THAT(reason("cone", {}, hidden), HasSubstr("whose frames the relief fills"));
  Scene mesh = kScene;
  mesh.surface.kind = SurfaceKind::mesh;
  EXPECT_THAT(reason("cone", {}, mesh), HasSubstr("no mesh"));
}

// Ids of before stay; what compute shaders have no part in has its text alone.
TEST(ComputeShader, is_in_the_id_where_it_is_chosen) {
  EXPECT_THAT(settings_of("relief").text(), Not(HasSubstr("dispatch")));
  EXPECT_THAT(by_compute(settings_of("relief")).text(), HasSubstr("&dispatch=compute"));
  const Settings plain = settings_of("relief");
  const auto ids = [](const Settings& settings) {
    std::vector<std::uint32_t> list;
    for (const SpecConstant& constant : constants_of(&settings, Wrap::repeat)) list.push_back(constant.id);
    return list;
  };
  EXPECT_EQ(ids(plain), ids(by_compute(plain)));
  EXPECT_EQ(frame_features(by_compute(plain)).size(), frame_features(plain).size());
}

class ComputeSweep : public CliTest {};

TEST_F(ComputeSweep, has_it_as_an_axis) {
  write("dispatch.json", R"({"name": "dispatch", "seed": 1,
    "scenes": [{"heightmap": "fbm", "views": ["oblique"], "frame_px": [32, 32]}],
    "measure": {"samples": 3},
    "sweeps": [{"technique": "cone", "axes": {"dispatch": ["fragment", "compute"], "depth": ["none", "write"]}}]})");
  const CommandResult sweep = run({"sweep", "dispatch.json", "--backend", "null", "-o", "run"});
  EXPECT_EQ(sweep.exit_code, 0) << sweep.err;
  EXPECT_THAT(sweep.out, HasSubstr("3 cases (0 from an earlier start): 3 ok"));
}

}  // namespace
}  // namespace reliefbench
