#include "backends/shader_compiler.h"

#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>
#include <glslang/build_info.h>

#include <algorithm>
#include <cstring>
#include <map>

#include "backends/spirv.h"
#include "kernels/base/cache.h"
#include "kernels/base/embedded.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "kernels/trace/surface.h"
#include "kernels/trace/technique.h"

namespace reliefbench {
namespace {

constexpr const char* kTechniqueFile = "technique.glsl";
constexpr const char* kReferenceFile = "reference.glsl";

/// What an #include finds beside the binary's own files, by its name there.
using Includes = std::map<std::string, ShaderText, std::less<>>;

struct Source {
  std::string file;  ///< as errors show it
  std::string_view text;
  EShLanguage stage;
  Includes includes{};
  Dialect dialect;
};

class EmbeddedIncluder final : public glslang::TShader::Includer {
 public:
  explicit EmbeddedIncluder(const Includes& includes) : includes_(includes) {}

  IncludeResult* includeLocal(const char* name, const char* /*includer*/, std::size_t /*depth*/) override {
    if (const auto found = includes_.find(name); found != includes_.end())
      return result(found->second.name, found->second.text);
    for (const EmbeddedFile& file : embedded_shaders())
      if (file.name == name) return result(std::string(name), file.text);
    return nullptr;  // glslang then reports the #include line
  }
  void releaseInclude(IncludeResult* included) override { delete included; }

 private:
  static IncludeResult* result(const std::string& name, std::string_view text) {
    return new IncludeResult(name, text.data(), text.size(), nullptr);
  }
  const Includes& includes_;
};

/// glslang's process-wide tables, held from the first compilation to the end of the process.
class GlslangProcess {
 public:
  GlslangProcess() { glslang::InitializeProcess(); }
  ~GlslangProcess() { glslang::FinalizeProcess(); }
  GlslangProcess(const GlslangProcess&) = delete;
  GlslangProcess& operator=(const GlslangProcess&) = delete;
};

/// The first error of glslang's log: "flat.glsl:2: 'x' : undeclared identifier".
std::string first_error(std::string_view log) {
  constexpr std::string_view kPrefix = "ERROR: ";
  const std::size_t start = log.find(kPrefix);
  if (start == std::string_view::npos) return std::string(log.substr(0, log.find('\n')));
  log.remove_prefix(start + kPrefix.size());
  std::string line(log.substr(0, log.find('\n')));
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

Spirv translate(const Source& source) {
  static const GlslangProcess process;

  const char* const text_data = source.text.data();
  const char* const name = source.file.c_str();
  const int length = static_cast<int>(source.text.size());

  glslang::TShader shader(source.stage);
  shader.setStringsWithLengthsAndNames(&text_data, &length, &name, 1);
  EShMessages rules = EShMsgSpvRules;
  if (source.dialect == Dialect::vulkan) {
    rules = static_cast<EShMessages>(rules | EShMsgVulkanRules);
    shader.setEnvInput(glslang::EShSourceGlsl, source.stage, glslang::EShClientVulkan, 100);
    shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_1);
    shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_3);
  } else {
    shader.setEnvInput(glslang::EShSourceGlsl, source.stage, glslang::EShClientOpenGL, 100);
    shader.setEnvClient(glslang::EShClientOpenGL, glslang::EShTargetOpenGL_450);
    shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_0);  // all that GL_ARB_gl_spirv promises
  }

  EmbeddedIncluder includer(source.includes);
  if (!shader.parse(GetDefaultResources(), 450, ENoProfile, false, false, rules, includer))
    fail_environment("{}", first_error(shader.getInfoLog()));
  glslang::TProgram program;
  program.addShader(&shader);
  if (!program.link(rules)) fail_environment("{}: {}", source.file, first_error(program.getInfoLog()));

  // Names stay for debuggers. The optimiser stays off: the drivers have their own, and every version of it would
  // change the hash that timings are stored under.
  glslang::SpvOptions options;
  options.disableOptimizer = true;
  options.validate = false;
  Spirv spirv;
  glslang::GlslangToSpv(*program.getIntermediate(source.stage), spirv, &options);
  return spirv;
}

/// All that the words of a translation depend on: any of the binary's files may be included.
std::string spirv_key(const Source& source) {
  static const std::string files = [] {
    std::string texts;
    for (const EmbeddedFile& file : embedded_shaders()) texts.append(file.name).append("\n").append(file.text);
    return sha256(texts);
  }();
  std::string key = fmt::format(
      "spirv 1, glslang {}.{}.{}{} {}, stage {}, dialect {}\n{}\n{}\n{}\n", GLSLANG_VERSION_MAJOR,
      GLSLANG_VERSION_MINOR, GLSLANG_VERSION_PATCH, GLSLANG_VERSION_FLAVOR, glslang::GetSpirvGeneratorVersion(),
      static_cast<int>(source.stage), static_cast<int>(source.dialect), files, source.file, sha256(source.text));
  for (const auto& [name, included] : source.includes)
    key += fmt::format("{} {} {}\n", name, included.name, sha256(included.text));
  return key;
}

const Codec<Spirv>& spirv_codec() {
  static const Codec<Spirv> codec{.write =
                                      [](const Spirv& spirv) {
                                        const auto bytes = std::as_bytes(std::span(spirv));
                                        return std::vector<std::byte>(bytes.begin(), bytes.end());
                                      },
                                  .read = [](std::span<const std::byte> bytes) -> std::optional<Spirv> {
                                    if (bytes.empty() || bytes.size() % sizeof(std::uint32_t) != 0) return std::nullopt;
                                    Spirv spirv(bytes.size() / sizeof(std::uint32_t));
                                    std::memcpy(spirv.data(), bytes.data(), bytes.size());
                                    return spirv.front() == kSpirvMagic ? std::optional(std::move(spirv))
                                                                        : std::nullopt;
                                  }};
  return codec;
}

/// glslang's tables alone take a quarter of a second to set up, so what was translated before is read.
Spirv compile(const Source& source) {
  const Cache cache(Cache::default_folder());
  return cached(cache, spirv_key(source), spirv_codec(), [&] { return translate(source); }).value;
}

/// One of the binary's own files.
Spirv compile_stage(std::string file, EShLanguage stage, Dialect dialect, Includes includes = {}) {
  const std::string_view text = embedded_text(embedded_shaders(), file);
  return compile(
      {.file = std::move(file), .text = text, .stage = stage, .includes = std::move(includes), .dialect = dialect});
}

/// The file that every trace includes.
Includes::value_type shared_constants() {
  return {"contract.glsl", {.name = "contract.glsl", .text = shared_contract()}};
}

Includes::value_type generated(const std::string& name, std::string text) {
  return {name, {.name = name, .text = std::move(text)}};
}

/// row: the technique's; null where it has none
Spirv compile_last_stage(const ShaderText& technique, const Technique* row, const Target& target, Dialect dialect,
                         std::span<const PixelFeature> features = {}, SurfaceKind surface = SurfaceKind::plane) {
  Includes includes{shared_constants(),
                    generated("parameters.glsl", row == nullptr ? "" : parameters_contract(*row)),
                    generated("features.glsl", features_contract(features)),
                    generated("feature_outputs.glsl", feature_outputs(features)),
                    {kTechniqueFile, technique}};
  if (row != nullptr)
    for (const auto& [file, text] : stand_ins(*row)) includes.insert(generated(file, text));
  if (is_curved(surface)) {
    includes.insert(generated("frame.glsl", frame_contract(features, surface, technique.name == kReferenceFile)));
    includes.insert(generated("surface.glsl", fmt::format("#include \"{}\"\n", surface_row(surface).shader)));
    if (surface_row(surface).has_mesh) includes.insert(generated("mesh_contract.glsl", mesh_contract()));
  }
  return compile_stage(fmt::format("{}.{}", is_score(target) ? "score" : "shade", target.by_compute ? "comp" : "frag"),
                       target.by_compute ? EShLangCompute : EShLangFragment, dialect, std::move(includes));
}

}  // namespace

Spirv compile_fragment(std::string_view technique, const Target& target, Dialect dialect,
                       std::span<const PixelFeature> features, SurfaceKind surface) {
  const std::string file = fmt::format("{}.glsl", technique);
  const ShaderText text{.name = file, .text = std::string(embedded_text(embedded_shaders(), file))};
  const auto row = std::ranges::find(techniques(), technique, &Technique::id);
  return compile_last_stage(text, row == techniques().end() ? nullptr : &*row, target, dialect, features, surface);
}

Spirv compile_fragment(const ShaderText& technique, const Target& target, Dialect dialect) {
  return compile_last_stage(technique, nullptr, target, dialect);
}

Spirv compile_whole_fragment(const ShaderText& shader, Dialect dialect) {
  return compile({.file = shader.name, .text = shader.text, .stage = EShLangFragment, .dialect = dialect});
}

Spirv compile_vertex(Dialect dialect, std::string_view name) {
  return compile_stage(fmt::format("{}.vert", name), EShLangVertex, dialect,
                       {shared_constants(), generated("mesh_contract.glsl", mesh_contract())});
}

Spirv compile_beside(std::string_view name, Dialect dialect) {
  return compile_stage(fmt::format("{}.frag", name), EShLangFragment, dialect, {shared_constants()});
}

Spirv compile_panel(PanelStage stage, Dialect dialect) {
  return stage == PanelStage::vertex ? compile_stage("panel.vert", EShLangVertex, dialect)
                                     : compile_stage("panel.frag", EShLangFragment, dialect);
}

Spirv compile_compute(std::string_view name, Dialect dialect, const ShaderText& contract) {
  return compile_stage(fmt::format("{}.comp", name), EShLangCompute, dialect, {{contract.name, contract}});
}

Spirv compile_filter(Dialect dialect) {
  return compile_stage("filter.frag", EShLangFragment, dialect, {shared_constants()});
}

Spirv compile_load(Dialect dialect, bool by_compute) {
  return by_compute ? compile_stage("load.comp", EShLangCompute, dialect)
                    : compile_stage("load.frag", EShLangFragment, dialect);
}

}  // namespace reliefbench
