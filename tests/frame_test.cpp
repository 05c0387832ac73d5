// Frames of several draws into named attachments, textures bound by the names that the shaders give them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tests/backend_rig.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;

class FrameTest : public BackendTest {};

/// The head of a fragment shader for both APIs; BINDING as in platform.glsl.
Spirv fragment(const Rig& rig, std::string_view body) {
  return compile_whole_fragment(
      {.name = "probe.frag",
       .text = "#version 450\n#extension GL_GOOGLE_include_directive : require\n#include \"platform.glsl\"\n" +
               std::string(body)},
      rig.row.dialect);
}

std::unique_ptr<Texture> one_texel(const Rig& rig, float value) {
  return rig.backend->upload({.width = 1,
                              .height = 1,
                              .layout = kFloat,
                              .texels = std::as_bytes(std::span(&value, 1)),
                              .filter = Filter::nearest});
}

FrameUniforms marked_frame(int width, int height, float mark = 0) {
  FrameUniforms frame{};
  frame.sizes = {width, height, 1, 1};
  frame.position[0] = mark;
  return frame;
}

std::vector<float> floats(std::span<const std::uint8_t> bytes) {
  std::vector<float> values(bytes.size() / sizeof(float));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

const Target kOneFloat{.attachments = {{"out_value", kFloat}}};

TEST_P(FrameTest, textures_are_bound_by_the_names_of_the_samplers) {
  on_every_device([](Rig& rig) {
    // Bindings in no order, and a sampler that nothing reads.
    const auto pipeline = rig.pipeline(fragment(rig, R"(
layout(BINDING(9)) uniform sampler2D first;
layout(BINDING(2)) uniform sampler2D second;
layout(BINDING(5)) uniform sampler2D unread;
layout(location = 0) out float out_value;
float texel(sampler2D map) { return texelFetch(map, ivec2(0), 0).x; }
void main() { out_value = 10.0 * texel(first) + texelFetch(second, ivec2(0), 0).x; }
)"),
                                       kOneFloat);
    const auto two = one_texel(rig, 2);
    const auto three = one_texel(rig, 3);
    const auto value_of = [&](Textures textures) {
      rig.backend->render({.pipeline = pipeline.get(), .textures = std::move(textures), .frame = marked_frame(1, 1)}, 1,
                          Timer::fenced_wall);
      return floats(rig.backend->read("out_value")).at(0);
    };
    EXPECT_EQ(value_of({{"first", two.get()}, {"second", three.get()}}), 23);
    EXPECT_EQ(value_of({{"first", three.get()}, {"second", two.get()}, {"of_another_shader", two.get()}}), 32);
    EXPECT_THAT(message_of([&] { value_of({{"first", two.get()}}); }), HasSubstr("`second`"));
    EXPECT_EQ(value_of({{"first", two.get()}, {"second", two.get()}}), 22);  // and it still works
  });
}

TEST_P(FrameTest, outputs_that_are_not_the_targets_attachments_are_refused) {
  on_every_device([](Rig& rig) {
    const Spirv one = fragment(rig, "layout(location = 0) out float out_value;\nvoid main() { out_value = 1.0; }\n");
    EXPECT_THAT(message_of([&] { (void)rig.pipeline(one, Target::color); }), HasSubstr("`out_color`"));
    const Target two{.attachments = {{"out_value", kFloat}, {"out_other", kFloat}}};
    EXPECT_THAT(message_of([&] { (void)rig.pipeline(one, two); }), AllOf(HasSubstr("`out_other`"), HasSubstr("1")));
    const Spirv both = fragment(rig,
                                "layout(location = 0) out float out_value;\nlayout(location = 1) out float out_other;\n"
                                "void main() { out_value = out_other = 1.0; }\n");
    EXPECT_THAT(message_of([&] { (void)rig.pipeline(both, kOneFloat); }), HasSubstr("2 outputs"));
    EXPECT_NE(rig.pipeline(both, two), nullptr);
  });
}

/// Colors a column of pixels with the draw's own mark, at a depth of its own.
constexpr std::string_view kColumn = R"(
layout(BINDING(0), std140) uniform Frame { vec4 position; vec4 right; vec4 up; vec4 forward; vec4 light; ivec4 sizes; }
frame;
layout(constant_id = 0) const int COLUMN = 0;  // this one and those to its right
layout(constant_id = 1) const int DEPTH = 0;   // eighths
layout(location = 0) out float out_value;
layout(location = 1) out vec4 out_color;
void main() {
  if (int(gl_FragCoord.x) < COLUMN) discard;
  gl_FragDepth = float(DEPTH) / 8.0;
  out_value = frame.position.x;
  out_color = vec4(1.0, 0.0, 0.0, 1.0);
}
)";

TEST_P(FrameTest, of_several_draws_the_nearest_fragments_stay_and_each_draw_has_its_own_uniforms) {
  on_every_device([](Rig& rig) {
    const Target target{
        .attachments = {{"out_value", kFloat}, {"out_color", {.type = TexelType::unorm8, .channels = 4}}},
        .has_depth = true};
    const Spirv column = fragment(rig, kColumn);
    const auto from = [&](int first, int depth) {
      return rig.pipeline(column, target, {{.id = 0, .value = first}, {.id = 1, .value = depth}});
    };
    const auto far = from(1, 6);
    const auto near = from(3, 2);
    const auto middle = from(2, 4);  // drawn last, behind `near`
    const std::array frame{Draw{.pipeline = far.get(), .frame = marked_frame(4, 2, 0.5F)},
                           Draw{.pipeline = near.get(), .frame = marked_frame(4, 2, 7)},
                           Draw{.pipeline = middle.get(), .frame = marked_frame(4, 2, 9)}};
    for (const int frames : {1, 3, 65}) {
      const BatchTime time = rig.backend->render(frame, frames, Timer::fenced_wall);
      EXPECT_GT(time.wall_ns, 0);
      EXPECT_THAT(floats(rig.backend->read("out_value")), ElementsAre(0, 0.5F, 9, 7, 0, 0.5F, 9, 7));
      EXPECT_THAT(floats(rig.backend->read("depth")), ElementsAre(1, .75F, .5F, .25F, 1, .75F, .5F, .25F));
      const std::vector<std::uint8_t> color = rig.backend->read_color();
      EXPECT_THAT(rig.backend->read("out_color"), ElementsAreArray(color));
      EXPECT_EQ(color.at(0), 0);
      EXPECT_EQ(color.at(4), 255);
    }
    for (const Timer timer : rig.backend->device().timers) EXPECT_GT(rig.backend->render(frame, 2, timer).wall_ns, 0);
  });
}

TEST_P(FrameTest, a_frame_has_one_target_and_the_last_one_that_has_an_attachment_is_read) {
  on_every_device([](Rig& rig) {
    const Spirv constant = fragment(rig, R"(
layout(constant_id = 0) const int VALUE = 0;
layout(location = 0) out float out_value;
void main() { out_value = float(VALUE); }
)");
    const Target deep{.attachments = kOneFloat.attachments, .has_depth = true};
    const auto flat = rig.pipeline(constant, kOneFloat, {{.id = 0, .value = 1}});
    const auto other = rig.pipeline(constant, deep, {{.id = 0, .value = 2}});
    const auto draw = [&](const Pipeline& pipeline, int width) {
      rig.backend->render({.pipeline = &pipeline, .frame = marked_frame(width, 1)}, 1, Timer::fenced_wall);
      return floats(rig.backend->read("out_value"));
    };
    EXPECT_THAT(draw(*flat, 2), ElementsAre(1, 1));
    EXPECT_THAT(draw(*other, 3), ElementsAre(2, 2, 2));
    EXPECT_THAT(draw(*flat, 1), ElementsAre(1));
    EXPECT_EQ(floats(rig.backend->read("depth")).size(), 3U);
    const std::array mixed{Draw{.pipeline = flat.get(), .frame = marked_frame(1, 1)},
                           Draw{.pipeline = other.get(), .frame = marked_frame(1, 1)}};
    EXPECT_THAT(message_of([&] { rig.backend->render(mixed, 1, Timer::fenced_wall); }), HasSubstr("different targets"));
    EXPECT_THAT(message_of([&] { rig.backend->render(std::span<const Draw>{}, 1, Timer::fenced_wall); }),
                HasSubstr("0 draws"));
    EXPECT_THAT(message_of([&] { (void)rig.backend->read("out_nothing"); }), HasSubstr("out_nothing"));
  });
}

// 8 GiB of attachments are more than the software rasterisers take.
TEST_P(FrameTest, a_frame_too_large_for_the_device_is_out_of_memory_by_its_code) {
  for (const DeviceInfo& device : row().devices()) {
    if (!device.software) continue;
    // OpenGL learns of it by asking, which its debug output tells of; Vulkan has to know before.
    const bool is_vulkan = row().id == "vulkan";
    const auto backend = row().open(device.index, {.debug = is_vulkan});
    const Spirv vertex = compile_vertex(row().dialect);
    const Spirv flat = compile_fragment("flat", Target::score, row().dialect);
    const auto pipeline = backend->compile(
        {.label = "flat", .vertex = vertex, .fragment = flat, .constants = {}, .target = Target::score});
    const auto draw = [&](int side) {
      backend->render({.pipeline = pipeline.get(), .frame = marked_frame(side, side)}, 1, Timer::fenced_wall);
    };
    try {
      draw(16384);
      FAIL() << "it was drawn";
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::out_of_memory) << error.what();
    }
    draw(8);  // and it still works
    EXPECT_EQ(backend->read_score().size(), 64U);
    EXPECT_THAT(backend->debug_messages(), ::testing::IsEmpty());
  }
}

INSTANTIATE_TEST_SUITE_P(backends, FrameTest, ::testing::Values("opengl", "vulkan"), backend_name);

}  // namespace
}  // namespace reliefbench
