#include "backends/cross_compiler.h"

#include <fmt/format.h>
#include <spirv_cross/spirv_cross_c.h>

#include <cstdint>
#include <memory>
#include <set>
#include <utility>

#include "backends/spirv.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

struct CrossOption {
  spvc_compiler_option option;
  unsigned value;
};

/// How SPIRV-Cross writes a language.
struct CrossLanguage {
  TextLanguage language;
  std::string_view name;
  spvc_backend backend;
  std::vector<CrossOption> options;
};

const std::vector<CrossLanguage>& cross_languages() {
  static const std::vector<CrossLanguage> languages = {
      {TextLanguage::glsl_es_310,
       "GLSL ES 3.10",
       SPVC_BACKEND_GLSL,
       {{SPVC_COMPILER_OPTION_GLSL_VERSION, 310},
        {SPVC_COMPILER_OPTION_GLSL_ES, 1},
        {SPVC_COMPILER_OPTION_GLSL_ES_DEFAULT_FLOAT_PRECISION_HIGHP, 1}}},
      {TextLanguage::hlsl,
       "HLSL",
       SPVC_BACKEND_HLSL,
       {{SPVC_COMPILER_OPTION_HLSL_SHADER_MODEL, 50}, {SPVC_COMPILER_OPTION_FORCE_ZERO_INITIALIZED_VARIABLES, 1}}},
      {TextLanguage::msl, "MSL", SPVC_BACKEND_MSL, {{SPVC_COMPILER_OPTION_MSL_VERSION, 20100}}}};
  return languages;
}

using Context = std::unique_ptr<spvc_context_s, decltype(&spvc_context_destroy)>;

Context new_context() {
  spvc_context context = nullptr;
  if (spvc_context_create(&context) != SPVC_SUCCESS) fail_environment("SPIRV-Cross cannot be started");
  return {context, spvc_context_destroy};
}

std::string translated(const Spirv& spirv, const CrossLanguage& language) {
  const Context context = new_context();
  const auto check = [&](spvc_result result) {
    if (result != SPVC_SUCCESS)
      fail_environment("SPIRV-Cross, {}: {}", language.name, spvc_context_get_last_error_string(context.get()));
  };
  spvc_parsed_ir ir = nullptr;
  check(spvc_context_parse_spirv(context.get(), spirv.data(), spirv.size(), &ir));
  spvc_compiler compiler = nullptr;
  check(spvc_context_create_compiler(context.get(), language.backend, ir, SPVC_CAPTURE_MODE_TAKE_OWNERSHIP, &compiler));
  spvc_compiler_options options = nullptr;
  check(spvc_compiler_create_compiler_options(compiler, &options));
  for (const CrossOption& one : language.options) check(spvc_compiler_options_set_uint(options, one.option, one.value));
  check(spvc_compiler_install_compiler_options(compiler, options));
  const char* text = nullptr;
  check(spvc_compiler_compile(compiler, &text));
  return text;
}

/// Without the overloads of mod that nothing calls: SPIRV-Cross writes those of all widths where it writes one.
std::string without_unused_mod(std::string text, const std::set<std::uint32_t>& widths) {
  for (std::uint32_t width = 1; width <= 4; ++width) {
    const std::string type = width == 1 ? "float" : fmt::format("float{}", width);
    const std::size_t begin = text.find(fmt::format("{0} mod({0} x, {0} y)\n{{\n", type));
    const std::size_t end = begin == std::string::npos ? begin : text.find("\n}\n\n", begin);
    if (end != std::string::npos && !widths.contains(width)) text.erase(begin, end + 4 - begin);
  }
  return text;
}

}  // namespace

std::string cross_compile(const Spirv& spirv, TextLanguage language) {
  for (const CrossLanguage& row : cross_languages())
    if (row.language == language)
      return language == TextLanguage::hlsl ? without_unused_mod(translated(spirv, row), remainder_widths(spirv))
                                            : translated(spirv, row);
  return naga_wgsl(with_plain_names(spirv));
}

}  // namespace reliefbench
