#include "reports/export/language.h"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <vector>

#include "backends/cross_compiler.h"
#include "kernels/base/suggest.h"

namespace reliefbench {
namespace {

Spirv example_spirv(const ShippedShader& shipped, MapArguments arguments) {
  const std::string text = example_shader(shipped, shipped_source(shipped, arguments), arguments);
  return compile_whole_fragment({.name = "relief.glsl", .text = text}, Dialect::vulkan);
}

ShippedText as_glsl(const ShippedShader& shipped) {
  const Pieces source = shipped_source(shipped, MapArguments::combined);
  const std::string header = shipped_header(shipped, "GLSL 4.50");
  return {.library = header + "\n" + with_short_lines(text_of(source)),
          .example = header + example_shader(shipped, source, MapArguments::combined)};
}

/// A translation, and the part of it that others call.
ShippedText translated(const ShippedShader& shipped, TextLanguage language, std::string_view name) {
  const bool is_wgsl = language == TextLanguage::wgsl;
  Pieces pieces = pieces_of(
      cross_compile(example_spirv(shipped, is_wgsl ? MapArguments::separate : MapArguments::combined), language));
  std::set<std::string> roots = shipped_entries(shipped);
  roots.insert({"metal", "float"});  // `using namespace metal`, `precision highp float`
  keep_needed(pieces, roots);
  for (Piece& piece : pieces)
    if (piece.text.starts_with("#version")) piece.is_needed = false;
  prefix_names(pieces);
  const std::string header = shipped_header(shipped, name);
  std::string library = header + "\n" + text_of(pieces);
  for (Piece& piece : pieces) piece.is_needed = true;
  const std::string whole = text_of(pieces);
  if (!whole.starts_with("#version")) return {.library = std::move(library), .example = header + "\n" + whole};
  const std::size_t line_end = whole.find('\n') + 1;  // it must be the first line
  return {.library = std::move(library), .example = whole.substr(0, line_end) + header + whole.substr(line_end)};
}

ShippedText as_glsl_es(const ShippedShader& shipped) {
  return translated(shipped, TextLanguage::glsl_es_310, "GLSL ES 3.10");
}
ShippedText as_hlsl(const ShippedShader& shipped) { return translated(shipped, TextLanguage::hlsl, "HLSL"); }
ShippedText as_msl(const ShippedShader& shipped) { return translated(shipped, TextLanguage::msl, "MSL 2.1"); }
ShippedText as_wgsl(const ShippedShader& shipped) { return translated(shipped, TextLanguage::wgsl, "WGSL"); }

ShippedText as_spirv(const ShippedShader& shipped) {
  const Spirv spirv = example_spirv(shipped, MapArguments::combined);
  std::string bytes(spirv.size() * sizeof(std::uint32_t), '\0');
  std::memcpy(bytes.data(), spirv.data(), bytes.size());
  return {.library = {}, .example = std::move(bytes)};
}

constexpr std::array kLanguages = {
    Language{"glsl", "GLSL 4.50 for OpenGL and Vulkan", "relief.glsl", "example.frag", "as it stands", as_glsl},
    Language{"glsl_es", "GLSL ES 3.10", "relief.es.glsl", "example.es.frag", "SPIRV-Cross", as_glsl_es},
    Language{"hlsl", "HLSL, shader model 5 and 6", "relief.hlsl", "example.hlsl", "SPIRV-Cross", as_hlsl},
    Language{"msl", "Metal Shading Language 2.1", "relief.metal", "example.metal", "SPIRV-Cross", as_msl},
    Language{"wgsl", "WebGPU Shading Language", "relief.wgsl", "example.wgsl", "naga", as_wgsl},
    Language{"spirv", "SPIR-V 1.3 for Vulkan 1.1", "", "example.spv", "glslang", as_spirv},
};

}  // namespace

std::span<const Language> languages() { return kLanguages; }

const Language& find_language(std::string_view id) { return find_row(kLanguages, "shading language", id); }

}  // namespace reliefbench
