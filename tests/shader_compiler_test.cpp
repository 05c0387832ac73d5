#include "backends/shader_compiler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "backends/gpu_bake.h"
#include "backends/spirv.h"
#include "kernels/base/error.h"
#include "kernels/trace/technique.h"
#include "tests/command.h"
#include "tests/own_cache.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class ShaderCompiler : public ::testing::TestWithParam<Dialect> {};

/// The stored strings of a module, as a debugger shows them (OpName and OpEntryPoint literals).
bool contains_text(const Spirv& spirv, std::string_view text) {
  const std::string_view bytes(reinterpret_cast<const char*>(spirv.data()), spirv.size() * sizeof(std::uint32_t));
  return bytes.find(text) != std::string_view::npos;
}

std::string compile_error(std::string_view text, Dialect dialect) {
  try {
    (void)compile_fragment({.name = "probe.glsl", .text = std::string(text)}, Target::score, dialect);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::environment);
    return error.what();
  }
  return "no error";
}

TEST_P(ShaderCompiler, every_stage_becomes_a_module_of_the_dialects_version) {
  const std::uint32_t version = GetParam() == Dialect::opengl ? 0x00010000 : 0x00010300;
  for (const Spirv& spirv :
       {compile_vertex(GetParam()), compile_load(GetParam()), compile_fragment("flat", Target::color, GetParam()),
        compile_fragment("reference", Target::score, GetParam())}) {
    ASSERT_GT(spirv.size(), 5u);
    EXPECT_EQ(spirv[0], kSpirvMagic);
    EXPECT_EQ(spirv[1], version);
    EXPECT_TRUE(contains_text(spirv, "main"));
  }
}

TEST_P(ShaderCompiler, the_module_is_the_same_every_time) {
  const TempFolder folder;
  std::vector<Spirv> modules;
  for (const char* cache : {"first", "second"}) {
    const OwnCache empty(folder / cache);
    modules.push_back(compile_fragment("flat", Target::color, GetParam()));
  }
  EXPECT_EQ(modules[0], modules[1]);
}

TEST_P(ShaderCompiler, what_was_translated_is_read_again_unless_it_is_damaged) {
  const TempFolder folder;
  const OwnCache cache(folder / "cache");
  const Spirv module = compile_load(GetParam());
  ASSERT_EQ(cache.files().size(), 1U);
  const std::filesystem::path kept = cache.files().front();
  std::filesystem::create_hard_link(kept, folder / "as_written");
  EXPECT_EQ(compile_load(GetParam()), module);
  EXPECT_TRUE(std::filesystem::equivalent(kept, folder / "as_written"));
  std::fstream(kept, std::ios::in | std::ios::out | std::ios::binary).seekp(100).put('?');
  EXPECT_EQ(compile_load(GetParam()), module);
  EXPECT_FALSE(std::filesystem::equivalent(kept, folder / "as_written"));  // written anew
  EXPECT_EQ(cache.files().size(), 1U);
}

TEST_P(ShaderCompiler, each_text_dialect_and_include_is_a_translation_of_its_own) {
  const TempFolder folder;
  const OwnCache cache(folder / "cache");
  for (const char* t : {"0.25", "0.5"}) {
    const std::string text = fmt::format("Hit trace(Ray ray) {{ return Hit({}, STATUS_HIT, 0, 0); }}\n", t);
    (void)compile_fragment({.name = "probe.glsl", .text = text}, Target::score, GetParam());
  }
  (void)compile_load(Dialect::vulkan);
  (void)compile_load(Dialect::opengl);
  EXPECT_EQ(cache.files().size(), 4U);
}

TEST_P(ShaderCompiler, names_are_kept_for_debuggers) {
  EXPECT_TRUE(contains_text(compile_fragment("flat", Target::score, GetParam()), "out_ray"));
  EXPECT_TRUE(contains_text(compile_load(GetParam()), "LOAD_STEPS"));
}

TEST_P(ShaderCompiler, targets_and_techniques_differ) {
  const Spirv flat = compile_fragment("flat", Target::color, GetParam());
  EXPECT_NE(flat, compile_fragment("flat", Target::score, GetParam()));
  EXPECT_NE(flat, compile_fragment("reference", Target::color, GetParam()));
}

TEST_P(ShaderCompiler, a_given_source_equals_the_embedded_one) {
  const std::string_view text = "Hit trace(Ray ray) { return Hit(polygon_t(), STATUS_HIT, 0, 0); }\n";
  EXPECT_EQ(compile_fragment({.name = "other.glsl", .text = std::string(text)}, Target::color, GetParam()),
            compile_fragment("flat", Target::color, GetParam()));
}

TEST_P(ShaderCompiler, an_error_names_file_line_and_cause) {
  EXPECT_THAT(compile_error("Hit trace(Ray ray) {\n  return nonsense;\n}\n", GetParam()),
              AllOf(StartsWith("probe.glsl:2: "), HasSubstr("nonsense"), HasSubstr("undeclared")));
}

TEST_P(ShaderCompiler, an_error_is_one_line) {
  const std::string message = compile_error("Hit trace(Ray ray) {\n  a = 1; b = 2;\n  return 3\n}\n", GetParam());
  EXPECT_THAT(message, StartsWith("probe.glsl:2: "));
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 0);
}

TEST_P(ShaderCompiler, a_missing_include_is_named) {
  EXPECT_THAT(compile_error("#include \"nowhere.glsl\"\n", GetParam()),
              AllOf(StartsWith("probe.glsl:1: "), HasSubstr("nowhere.glsl")));
}

TEST_P(ShaderCompiler, a_technique_without_a_trace_is_refused) {
  EXPECT_THAT(compile_error("float unused() { return 0.0; }\n", GetParam()), HasSubstr("trace"));
}

TEST_P(ShaderCompiler, an_unknown_technique_is_named) {
  try {
    (void)compile_fragment("nowhere", Target::color, GetParam());
    FAIL() << "compiled";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("nowhere.glsl"));
  }
}

TEST_P(ShaderCompiler, every_stage_is_valid_by_the_specifications_own_validator) {
  const TempFolder folder;
  int modules = 0;
  const auto write = [&](const std::string& name, const Spirv& spirv) {
    std::ofstream((folder / (name + ".spv")), std::ios::binary)
        .write(reinterpret_cast<const char*>(spirv.data()), static_cast<std::streamsize>(spirv.size() * 4));
    ++modules;
  };
  write("fullscreen", compile_vertex(GetParam()));
  write("load", compile_load(GetParam()));
  write("reference", compile_fragment("reference", Target::color, GetParam()));
  for (const Technique& technique : techniques()) {
    write(std::string(technique.id) + ".shade", compile_fragment(technique.id, Target::color, GetParam()));
    write(std::string(technique.id) + ".score", compile_fragment(technique.id, Target::score, GetParam()));
  }
  for (const MapKind kind : gpu_bakers())
    for (const auto& [name, spirv] : compile_baker(kind, GetParam(), BakeDevice{}))
      write(fmt::format("{}.{}", find_map(kind).id, name), spirv);
  for (const auto& [name, spirv] : compile_baker(MapKind::conservative, GetParam(), BakeDevice{.has_doubles = false}))
    write(fmt::format("floats.{}", name), spirv);
  for (const auto& [name, spirv] : compile_baker(MapKind::relaxed_po07, GetParam(), BakeDevice{.is_software = false}))
    write(fmt::format("hardware.{}", name), spirv);
  for (const char* format : {"rg8", "rg16f", "rg32f", "rgba8"})
    for (const Encoding& encoding : encodings())
      write(fmt::format("pack.{}.{}", format, encoding.id),
            compile_baker(MapKind::quick, GetParam(), BakeDevice{},
                          BakePacking{.format = find_format(format), .encoding = encoding})
                .at("bake_pack"));
  const std::string command = fmt::format(
      "cd '{}' && for module in *.spv; do spirv-val --target-env {} $module || echo in $module; done >log 2>&1",
      folder.path().string(), GetParam() == Dialect::vulkan ? "vulkan1.1" : "spv1.0");
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(file_text(folder / "log"), "");
  EXPECT_GT(modules, 30);
}

TEST_P(ShaderCompiler, it_works_again_after_an_error) {
  (void)compile_error("syntax error", GetParam());
  EXPECT_EQ(compile_vertex(GetParam())[0], kSpirvMagic);
}

INSTANTIATE_TEST_SUITE_P(dialects, ShaderCompiler, ::testing::Values(Dialect::vulkan, Dialect::opengl),
                         [](const auto& param) { return param.param == Dialect::vulkan ? "vulkan" : "opengl"; });

}  // namespace
}  // namespace reliefbench
