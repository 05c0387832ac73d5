// What ships in languages other than the suite's own: each text compiles with the language's own compiler where there
// is one here, and what can be run finds the same hits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "backends/cross_compiler.h"
#include "reports/export/container.h"
#include "reports/export/engine.h"
#include "tests/browser.h"
#include "tests/command.h"
#include "tests/export_rig.h"
#include "tests/thorough.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Every technique, and one of each way to read a map and to throw shadows.
std::vector<std::string> translated_settings() {
  std::vector<std::string> ids = shipped_techniques();
  for (const char* id : {"cone?correction=min4&step=cell_max&format=r8+r8", "cone?lod=footprint&encoding=atan",
                         "quad_cone?refinement=binary&filter=manual&shadow=linear", "cone?shadow=cone&format=rgba8",
                         "cone?step=plain&over_relaxation=auto", "sector_cone?ratios_a_texel=2&over_relaxation=auto",
                         "cone?silhouette=quadric&shadow=linear", "cell_cone?shadow=cell",
                         "relief?silhouette=quadric_exact", "relief?dither=temporal"})
    ids.emplace_back(id);
  return ids;
}

/// Calls compilers on files of its own.
class Compilers {
 public:
  /// glslangValidator on a fragment shader: "" if it compiles. options: `-D -e main` for HLSL, `-V` for SPIR-V of
  /// Vulkan
  std::string glslang(const std::string& options, const std::string& text) {
    std::ofstream(folder_ / "shader.frag") << text;
    return said(fmt::format("glslangValidator {} -S frag -o '{}' '{}'", options, spirv_path(),
                            (folder_ / "shader.frag").string()));
  }
  std::string spirv_val() { return said(fmt::format("spirv-val '{}'", spirv_path())); }
  std::string spirv_val(const std::string& module) {
    std::ofstream(folder_ / "shader.spv", std::ios::binary) << module;
    return spirv_val();
  }
  /// What the last call of glslang made.
  [[nodiscard]] Spirv spirv() const {
    const std::string bytes = file_text(spirv_path());
    Spirv words(bytes.size() / sizeof(std::uint32_t));
    std::memcpy(words.data(), bytes.data(), words.size() * sizeof(std::uint32_t));
    return words;
  }
  /// The same as GLSL with combined samplers, which our backends bind.
  std::string as_glsl() {
    std::string text =
        output_of(fmt::format("spirv-cross --version 450 --combined-samplers-inherit-bindings '{}'", spirv_path()));
    text = std::regex_replace(text, std::regex("SPIRV_Cross_Combined(relief_map|extra_map|rays)\\w*"), "$1");
    text = std::regex_replace(text, std::regex("\\b(out_\\w+)"), "plain_$1");
    text = std::regex_replace(text, std::regex("_entryPointOutput_"), "");
    std::string once;  // one map with two samplers is one
    for (const std::string& line : lines_of(text))
      if (!line.starts_with("layout(binding") || once.find(line) == std::string::npos) once += line + "\n";
    return once;
  }

 private:
  [[nodiscard]] std::string spirv_path() const { return (folder_ / "shader.spv").string(); }
  static std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }
  static std::string said(const std::string& command) {
    const std::string text = output_of(command + " 2>&1 || echo failed");
    return text.find("failed") == std::string::npos ? "" : text;
  }
  TempFolder folder_;
};

/// No dead code: every function has one definition and is called, but for those that others call.
void expect_all_called(const std::string& text, const std::set<std::string>& entries) {
  std::map<std::string, int> words;
  for (const std::string& word : words_of(text)) ++words[word];
  std::set<std::string> defined;
  for (const Piece& piece : pieces_of(text)) {
    if (!piece.is_function) continue;
    const std::string& name = piece.names.front();
    EXPECT_TRUE(defined.insert(name).second) << name << " is overloaded";
    EXPECT_TRUE(words[name] > 1 || entries.contains(name)) << name << " is not called";
  }
}

TEST(ShippedLanguages, compile_with_their_own_compilers) {
  Compilers compilers;
  std::size_t number = 0;
  for (const std::string& id : translated_settings()) {
    if (!is_turn(number++, true)) continue;  // others are compiled where they are drawn
    SCOPED_TRACE(id);
    const ShippedCase shipped(id);
    EXPECT_EQ(compilers.spirv_val(find_language("spirv").write(shipped.shader()).example), "");
    const ShippedText es = find_language("glsl_es").write(shipped.shader());
    EXPECT_EQ(compilers.glslang("-V", es.example), "") << es.example;
    EXPECT_EQ(compilers.spirv_val(), "");
    const ShippedText hlsl = find_language("hlsl").write(shipped.shader());
    EXPECT_EQ(compilers.glslang("-D -V -e main", hlsl.example), "") << hlsl.example;
    EXPECT_EQ(compilers.spirv_val(), "");
    const ShippedText msl = find_language("msl").write(shipped.shader());
    EXPECT_THAT(msl.library, HasSubstr("using namespace metal;"));
    // The library is what the example calls, all of it under the prefix, and nothing of the example.
    for (const ShippedText& text : {es, hlsl, msl}) {
      EXPECT_THAT(text.library, HasSubstr("ReliefSurface relief_trace("));
      EXPECT_THAT(text.library, Not(HasSubstr("main(")));
      EXPECT_THAT(text.library, Not(HasSubstr("bound_")));
      for (const Piece& piece : pieces_of(text.library))
        for (const std::string& name : piece.names)
          EXPECT_TRUE(prefixed_name(name) == name || name == "metal" || name == "float" || name == "int") << name;
      std::set<std::string> called = shipped_entries(shipped.shader());
      expect_all_called(text.library, called);
      called.insert({"main", "main0", "frag_main"});
      expect_all_called(text.example, called);
    }
  }
}

/// Pixels whose hits differ by more than 1e-5, or in their taps.
int differing_pixels(const ScoreFrame& found, const ScoreFrame& expected, int& traced) {
  int differing = 0;
  for (std::size_t i = 0; i < expected.pixels.size(); ++i) {
    const ScorePixel& a = found.pixels[i];
    const ScorePixel& b = expected.pixels[i];
    if (static_cast<PixelStatus>(b.status) == PixelStatus::no_ray) continue;
    ++traced;
    const bool is_same = std::abs(a.t - b.t) <= 1e-5F && a.status == b.status && a.taps == b.taps;
    const bool has_same_shadow =
        expected.values.empty() || std::abs(found.values.front()[i] - expected.values.front()[i]) <= 1e-5F;
    differing += is_same && has_same_shadow ? 0 : 1;
  }
  return differing;
}

class ShippedLanguagesOnVulkan : public BackendTest {};

TEST_P(ShippedLanguagesOnVulkan, find_the_suites_hits) {
  Compilers compilers;
  on_every_device([&](const Rig& rig) {
    int traced = 0;
    int of_es = 0;
    int of_hlsl = 0;
    std::size_t number = 0;
    for (const std::string& id : translated_settings()) {
      if (!is_turn(number++, false)) continue;
      SCOPED_TRACE(id);
      const ShippedCase shipped(id);
      if (reads_what_no_score_frame_tells(shipped.settings)) continue;
      const ScoreFrame expected = suite_frame(rig, shipped);
      const FrameUniforms frame = frame_uniforms(shipped_scene(shipped.wrap), small_fbm().width, small_fbm().height);
      const Spirv source = compile_whole_fragment({.name = id, .text = rays_shader(shipped, frame)}, Dialect::vulkan);
      ASSERT_EQ(compilers.glslang("-V", cross_compile(source, TextLanguage::glsl_es_310)), "");
      of_es += differing_pixels(frame_of_rays(rig, shipped, compilers.spirv(), expected.pixels), expected, traced);
      ASSERT_EQ(compilers.glslang("-D -V -e main", cross_compile(source, TextLanguage::hlsl)), "");
      const Spirv back = compile_whole_fragment({.name = id, .text = compilers.as_glsl()}, Dialect::vulkan);
      of_hlsl += differing_pixels(frame_of_rays(rig, shipped, back, expected.pixels), expected, traced);
    }
    EXPECT_GT(traced, 10'000);
    EXPECT_LE(of_es, traced / 2 / 10'000);
    EXPECT_LE(of_hlsl, traced / 2 / 10'000);
  });
}

TEST_P(ShippedLanguagesOnVulkan, find_the_same_hits_far_away) {
  Compilers compilers;
  on_every_device([&](const Rig& rig) {
    for (const char* id : {"cone", "relief?shadow=linear"}) {
      SCOPED_TRACE(id);
      const ShippedCase shipped(id);
      const std::vector<ScorePixel> rays = suite_frame(rig, shipped).pixels;
      const auto es = [&](int tiles) {
        const Spirv source = compile_whole_fragment({.name = id, .text = far_shader(shipped, tiles)}, Dialect::vulkan);
        EXPECT_EQ(compilers.glslang("-V", cross_compile(source, TextLanguage::glsl_es_310)), "");
        return frame_of_rays(rig, shipped, compilers.spirv(), rays);
      };
      const auto hlsl = [&](int tiles) {
        const Spirv source = compile_whole_fragment({.name = id, .text = far_shader(shipped, tiles)}, Dialect::vulkan);
        EXPECT_EQ(compilers.glslang("-D -V -e main", cross_compile(source, TextLanguage::hlsl)), "");
        const Spirv back = compile_whole_fragment({.name = id, .text = compilers.as_glsl()}, Dialect::vulkan);
        return frame_of_rays(rig, shipped, back, rays);
      };
      expect_same_surfaces(es(0), es(1024), rays);
      expect_same_surfaces(hlsl(0), hlsl(1024), rays);
    }
  });
}
INSTANTIATE_TEST_SUITE_P(backends, ShippedLanguagesOnVulkan, ::testing::Values("vulkan"), backend_name);

/// One engine's files for a setting, by their names.
std::map<std::string, std::string> files_of(std::string_view engine, const ShippedCase& shipped) {
  const ShippedShader shader = shipped.shader();
  std::map<std::string, std::string> files;
  for (ExportedFile& file : engine_files(find_engine(engine), {.shader = shader}, {}, "").files)
    files.emplace(std::move(file.name), std::move(file.bytes));
  return files;
}

/// O3DE has no file for levels.
bool is_taken(std::string_view engine, const ShippedCase& shipped) {
  const auto& [relief, extra] = shipped.map.textures;
  return engine != "o3de" || (relief.levels == 1 && (!extra || extra->levels == 1));
}

/// Settings that have each of the engines' own lines: an extra map with levels, shadow, clamp, no map.
const std::vector<std::pair<std::string, Wrap>>& engine_cases() {
  static const std::vector<std::pair<std::string, Wrap>> cases = {{"cone?shadow=cone", Wrap::clamp},
                                                                  {"qdm", Wrap::repeat},
                                                                  {"cone?lod=footprint&format=r8+r8", Wrap::repeat},
                                                                  {"flat", Wrap::repeat}};
  return cases;
}

TEST(ShippedEngines, their_shaders_compile_within_what_the_engines_give_them) {
  Compilers compilers;
  for (const auto& [id, wrap] : engine_cases()) {
    SCOPED_TRACE(id);
    const ShippedCase shipped(id, wrap);
    const bool has_extra = shipped.map.textures.extra.has_value();
    const bool has_map = shipped.settings.technique().reads_map();
    const bool has_shadow = has_value_of(shipped.settings, Query::shadow);

    // Unreal puts a node's text into a function whose arguments are the node's inputs.
    auto unreal = files_of("unreal", shipped);
    const std::string node = unreal.at("Relief.usf") +
                             "float3 CustomExpression0(Texture2D ReliefMap, SamplerState ReliefMapSampler, Texture2D "
                             "ExtraMap, SamplerState ExtraMapSampler, float2 UV, float3 CameraVectorTS, float Depth, "
                             "float3 LightTS, inout float Height, inout float Hit, inout float Shadow, inout float3 "
                             "NormalTS) {\n" +
                             unreal.at("CustomNode.txt") +
                             "}\nTexture2D a : register(t0); SamplerState as : register(s1); Texture2D b : "
                             "register(t2); SamplerState bs : register(s3);\n"
                             "float4 main(float2 uv : TEXCOORD0, float3 v : TEXCOORD1) : SV_Target0 {\n"
                             "  float h = 0, i = 0, s = 0; float3 n = 0;\n"
                             "  return float4(CustomExpression0(a, as, b, bs, uv, v, 0.1, v, h, i, s, n), h + s + n.x);"
                             "\n}\n";
    EXPECT_EQ(compilers.glslang("-D -V -e main", node), "") << node;

    // Unity's types, as its shader library has them.
    auto unity = files_of("unity", shipped);
    std::string graph = unity.at("Relief.hlsl");
    const std::string include = "#include \"ReliefTrace.hlsl\"\n";
    ASSERT_NE(graph.find(include), std::string::npos);
    graph.replace(graph.find(include), include.size(), unity.at("ReliefTrace.hlsl"));
    graph =
        "struct UnitySamplerState { SamplerState samplerstate; };\n"
        "struct UnityTexture2D { Texture2D tex; UnitySamplerState samplerstate; };\n" +
        graph;
    EXPECT_EQ(compilers.glslang("-D -V -e main", graph + "float4 main() : SV_Target0 { return float4(0, 0, 0, 0); }\n"),
              "")
        << graph;
    EXPECT_THAT(unity.at("ReliefURP.shader"), HasSubstr("relief_trace("));

    if (is_taken("o3de", shipped)) {
      const std::string o3de = files_of("o3de", shipped).at("Relief.azsli");
      EXPECT_EQ(
          compilers.glslang("-D -V -e main", o3de + "float4 main() : SV_Target0 { return float4(0, 0, 0, 0); }\n"), "");
    }

    // Godot's language is GLSL but for its uniforms' hints and what a fragment is given.
    std::string godot = files_of("godot", shipped).at("relief.gdshader");
    EXPECT_TRUE(godot.starts_with("shader_type spatial;\n"));
    EXPECT_THAT(godot, Not(HasSubstr("highp")));
    godot = std::regex_replace(godot, std::regex("shader_type spatial;"), "");
    int binding = 0;
    for (std::smatch found; std::regex_search(godot, found, std::regex("\nuniform sampler2D (\\w+) : [\\w, ]+;"));)
      godot.replace(static_cast<std::size_t>(found.position()), static_cast<std::size_t>(found.length()),
                    fmt::format("\nlayout(binding = {}) uniform sampler2D {};", binding++, found[1].str()));
    EXPECT_EQ(binding, (has_map ? 1 : 0) + (has_extra ? 1 : 0));
    godot = std::regex_replace(godot, std::regex("\nuniform (vec[0-9]|float) (\\w+)( : source_color)? ="),
                               "\nconst $1 $2 =");
    godot =
        "#version 450\nlayout(location = 0) in vec2 UV;\nlayout(location = 1) in vec3 VIEW;\n"
        "layout(location = 2) in vec3 TANGENT;\nlayout(location = 3) in vec3 BINORMAL;\n"
        "layout(location = 0) out vec3 ALBEDO;\nlayout(location = 1) out vec3 NORMAL;\n"
        "const mat4 VIEW_MATRIX = mat4(1.0);\n" +
        godot + "void main() { NORMAL = vec3(0.0, 0.0, 1.0); fragment(); }\n";
    EXPECT_EQ(compilers.glslang("-V", godot), "") << godot;
    EXPECT_EQ(godot.find("surface.shadow") != std::string::npos, has_shadow);
  }
}

TEST(ShippedEngines, sheets_have_three_steps_at_most_and_nothing_left_to_fill) {
  for (const auto& [id, wrap] : engine_cases())
    for (const Engine& engine : engines()) {
      const ShippedCase shipped(id, wrap);
      if (engine.language == "wgsl" || !is_taken(engine.id, shipped)) continue;  // WGSL: see below
      SCOPED_TRACE(fmt::format("{} {}", engine.id, id));
      const auto files = files_of(engine.id, shipped);
      const std::string sheet = files.at("README.md");
      EXPECT_THAT(sheet, Not(HasSubstr("\n4. ")));
      EXPECT_THAT(sheet, HasSubstr("heights go down from it"));
      for (const char* left : {"\n?", "\n!", "@"}) EXPECT_THAT(sheet, Not(HasSubstr(left))) << sheet;
      EXPECT_EQ(sheet.find("Sign and zero") != std::string::npos, engine.id != "plain");
    }
}

class ShippedWgsl : public InBrowser {};

/// Bevy's material with what its imports stand for.
std::string bevy_shader(const std::map<std::string, std::string>& files) {
  std::string library = files.at("assets/relief/relief.wgsl");
  std::string material = files.at("assets/relief/relief_material.wgsl");
  library = std::regex_replace(library, std::regex("#define_import_path [^\n]*"), "");
  material = std::regex_replace(material, std::regex("#import [^\n]*"), "");
  material = std::regex_replace(material, std::regex("#\\{MATERIAL_BIND_GROUP\\}"), "3");
  return "struct VertexOutput { @builtin(position) position: vec4<f32>, @location(0) world_position: vec4<f32>, "
         "@location(1) world_normal: vec3<f32>, @location(2) uv: vec2<f32>, @location(3) world_tangent: vec4<f32> }\n"
         "struct View { world_position: vec3<f32> }\n@group(0) @binding(0) var<uniform> view: View;\n" +
         library + material;
}

TEST_F(ShippedWgsl, compiles_in_a_browser) {
  nlohmann::json shaders = nlohmann::json::object();
  std::size_t number = 0;
  try {
    for (const std::string& id : shipped_techniques())
      if (is_turn(number++, true)) shaders[id] = find_language("wgsl").write(ShippedCase(id).shader()).example;
    for (const auto& [id, wrap] : engine_cases())
      if (is_turn(number++, true)) shaders["bevy " + id] = bevy_shader(files_of("bevy", ShippedCase(id, wrap)));
  } catch (const Error& error) {
    FAIL() << error.what();
  }
  shaders["wrong"] = "fn f() -> i32 { return 1.0; }";
  const std::string page = "<body><script>" + std::string(kHold) + "const shaders = " + shaders.dump() + R"(;
const put = document.body.dataset;
(async () => {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) { put.adapter = 'none'; return; }
  const device = await adapter.requestDevice();
  put.compiled = '';
  for (const [id, code] of Object.entries(shaders)) {
    device.pushErrorScope('validation');  // so that what is wrong is not said twice
    const info = await device.createShaderModule({code}).getCompilationInfo();
    await device.popErrorScope();
    const errors = info.messages.filter((one) => one.type === 'error');
    if (errors.length) put.failed = (put.failed ?? '') + `${id}: ${errors[0].lineNum}: ${errors[0].message}; `;
    else put.compiled += id + ' ';
  }
  put.rendered = 'true';
})().finally(() => hold.close());
</script>
</body>)";
  const std::string body = body_tag(document(page, "", {.with_webgpu = true}));
  if (body.find("data-adapter=\"none\"") != std::string::npos) GTEST_SKIP() << "this browser has no WebGPU";
  EXPECT_THAT(body, HasSubstr("data-rendered=\"true\"")) << body;
  shaders.erase("wrong");
  for (const auto& [id, code] : shaders.items())
    EXPECT_THAT(body, HasSubstr(std::regex_replace(id, std::regex("&"), "&amp;") + " "));
  EXPECT_THAT(body, HasSubstr("data-failed=\"wrong: 1: ")) << body;  // and nothing before it
  EXPECT_THAT(body, Not(HasSubstr("; bevy"))) << body;
}

}  // namespace
}  // namespace reliefbench
