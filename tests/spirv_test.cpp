#include "backends/spirv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "backends/gpu_bake.h"
#include "backends/shader_compiler.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::ThrowsMessage;

TEST(Spirv, constants_are_listed_with_their_names) {
  for (const Dialect dialect : {Dialect::opengl, Dialect::vulkan}) {
    const std::vector<DeclaredConstant> load = reflect(compile_load(dialect)).constants;
    ASSERT_EQ(load.size(), 1u);
    EXPECT_EQ(load[0].id, 0u);
    EXPECT_EQ(load[0].name, "LOAD_STEPS");
    EXPECT_THAT(reflect(compile_vertex(dialect)).constants, IsEmpty());
  }
}

std::vector<std::pair<std::string, std::uint32_t>> places(const std::vector<ShaderVariable>& variables) {
  std::vector<std::pair<std::string, std::uint32_t>> list;
  for (const ShaderVariable& variable : variables) list.emplace_back(variable.name, variable.place);
  return list;
}

TEST(Spirv, what_the_code_reads_is_listed_by_name_and_place) {
  for (const Dialect dialect : {Dialect::opengl, Dialect::vulkan}) {
    const ShaderInterface shade = reflect(compile_fragment("relief", Target::color, dialect));
    EXPECT_THAT(places(shade.samplers), ElementsAre(Pair(kReliefMap, 1), Pair(kNormalMap, 2)));
    EXPECT_THAT(places(shade.uniform_blocks), ElementsAre(Pair("Frame", 0)));
    EXPECT_THAT(places(shade.outputs), ElementsAre(Pair("out_color", 0)));
    const ShaderInterface score = reflect(compile_fragment("quad_cone", Target::score, dialect));
    EXPECT_THAT(places(score.samplers), ElementsAre(Pair(kReliefMap, 1), Pair(kExtraMap, 4)));
    EXPECT_THAT(places(score.outputs), ElementsAre(Pair("out_ray", 0), Pair("out_hit", 1)));
    // Declared, but nothing reads them.
    EXPECT_THAT(reflect(compile_fragment("flat", Target::score, dialect)).samplers, IsEmpty());
    const ShaderInterface vertex = reflect(compile_vertex(dialect));
    EXPECT_THAT(vertex.uniform_blocks, IsEmpty());
    EXPECT_THAT(vertex.outputs, IsEmpty());  // gl_Position has no location
  }
}

TEST(Spirv, a_compute_shader_says_how_it_sees_its_buffers) {
  const Spirv shader =
      compile_baker(MapKind::conservative, Dialect::vulkan, BakeDevice{.has_doubles = false}).at("bake_exact");
  using enum BufferView;
  EXPECT_THAT(buffer_views(shader, 5), ElementsAre(storage, block, storage, texels, storage));
  EXPECT_THAT([&] { (void)buffer_views(shader, 3); }, ThrowsMessage<Error>(HasSubstr("`quads` is at binding 3, of 3")));
}

TEST(Spirv, stages_share_their_bindings_or_quarrel_over_them) {
  const ShaderInterface a{.constants = {{.id = 1, .name = "A"}},
                          .samplers = {{.name = "map", .place = 2}},
                          .uniform_blocks = {{.name = "Frame", .place = 0}},
                          .outputs = {},
                          .images = {}};
  ShaderInterface b{.constants = {},
                    .samplers = {{.name = "other", .place = 1}, {.name = "map", .place = 2}},
                    .uniform_blocks = {},
                    .outputs = {{.name = "out_color", .place = 0}},
                    .images = {}};
  const ShaderInterface both = joined(a, b);
  EXPECT_THAT(places(both.samplers), ElementsAre(Pair("other", 1), Pair("map", 2)));
  EXPECT_EQ(both.uniform_blocks, a.uniform_blocks);
  EXPECT_EQ(both.outputs, b.outputs);
  EXPECT_EQ(both.constants.size(), 1U);
  b.samplers[0].place = 0;
  EXPECT_THAT([&] { (void)joined(a, b); }, ThrowsMessage<Error>(HasSubstr("`Frame`")));
  b.samplers[0].place = 2;
  EXPECT_THAT([&] { (void)joined(a, b); }, ThrowsMessage<Error>(AllOf(HasSubstr("`map`"), HasSubstr("`other`"))));
}

TEST(Spirv, another_descriptor_set_is_refused) {
  const std::string text =
      "#version 450\nlayout(set = 1, binding = 0) uniform sampler2D map;\nlayout(location = 0) out vec4 color;\n"
      "void main() { color = texture(map, vec2(0.0)); }\n";
  const Spirv spirv = compile_whole_fragment({.name = "probe.frag", .text = text}, Dialect::vulkan);
  EXPECT_THAT([&] { (void)reflect(spirv); }, ThrowsMessage<Error>(AllOf(HasSubstr("`map`"), HasSubstr("set 1"))));
}

// Whatever a word of a module becomes, reflection answers or refuses.
TEST(Spirv, no_changed_word_crashes_reflection) {
  const Spirv good = compile_fragment("cone", Target::score, Dialect::vulkan);
  int refused = 0;
  for (std::size_t at = 0; at < good.size(); at += 7)
    for (const std::uint32_t word : {0U, 1U, good[at] ^ 0x00010000U, 0xffffffffU}) {
      Spirv bad = good;
      bad[at] = word;
      try {
        (void)reflect(bad);
      } catch (const Error&) {
        ++refused;
      }
    }
  EXPECT_GT(refused, 0);
}

TEST(Spirv, a_broken_module_is_refused) {
  Spirv spirv = compile_load(Dialect::vulkan);
  EXPECT_THROW((void)reflect(std::span(spirv).first(3)), Error);
  spirv[5] = 0;  // an instruction of no words
  EXPECT_THROW((void)reflect(spirv), Error);
}

}  // namespace
}  // namespace reliefbench
