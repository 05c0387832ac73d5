#include "reports/export/engine.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/suggest.h"
#include "reports/export/shader_pieces.h"

namespace reliefbench {
namespace {

std::string as_named(std::string_view map) { return std::string(map); }

/// For languages that have each texture's sampler beside it.
std::string in_unreal(std::string_view map) {
  return map == kReliefMap ? "ReliefMap, ReliefMapSampler" : "ExtraMap, ExtraMapSampler";
}
std::string in_shader_graph(std::string_view map) {
  const std::string_view name = map == kReliefMap ? "ReliefMap" : "ExtraMap";
  return fmt::format("{0}.tex, {0}.samplerstate.samplerstate", name);
}
std::string in_urp(std::string_view map) {
  const std::string_view name = map == kReliefMap ? "_ReliefMap" : "_ExtraMap";
  return fmt::format("{0}, sampler{0}", name);
}
/// Its functions' arguments may not be called as uniforms are.
std::string in_godot(std::string_view map) { return map == kReliefMap ? "relief_texture" : "extra_texture"; }
std::string in_o3de(std::string_view map) {
  return map == kReliefMap ? "m_reliefMap, m_reliefSampler" : "m_extraMap, m_reliefSampler";
}

std::string unreal_compression(const TexelLayout& layout) {
  return layout.type == TexelType::unorm8 ? "VectorDisplacementmap (RGBA8)" : "HDR High Precision (RGBA32F)";
}

bool has_blocks(const TextureImage& image) { return is_of_blocks(image.layout.type); }

bool has_levels(const TextureImage& image) { return image.levels > 1; }
bool is_wide(const TextureImage& image) { return image.layout.type != TexelType::unorm8; }

std::string unity_compression(const TexelLayout& layout) {
  const bool is_one = layout.channels == 1;
  switch (layout.type) {
    case TexelType::unorm8:
      return is_one ? "R 8" : "RGBA 32 bit";
    case TexelType::unorm16:
      return is_one ? "R 16 bit" : "RGBA 64 bit";
    case TexelType::float16:
      return is_one ? "R Half" : "RGBA Half";
    case TexelType::rgtc:
      return is_one ? "BC4" : "BC5";
    case TexelType::eac:
      return is_one ? "R Compressed EAC 4 bit" : "RG Compressed EAC 8 bit";
    case TexelType::bc7:
      return "BC7";
    case TexelType::astc:
    case TexelType::float32:
      break;
  }
  return is_one ? "R Float" : "RGBA Float";
}

std::string_view wgpu_feature(TexelType type) {
  switch (type) {
    case TexelType::unorm16:
      return "TEXTURE_FORMAT_16BIT_NORM";
    case TexelType::float32:
      return "FLOAT32_FILTERABLE";
    case TexelType::rgtc:
    case TexelType::bc7:
      return "TEXTURE_COMPRESSION_BC";
    case TexelType::eac:
      return "TEXTURE_COMPRESSION_ETC2";
    case TexelType::unorm8:
    case TexelType::float16:
    case TexelType::astc:
      break;
  }
  return "";
}

/// A preset that takes values as they are: others, ReferenceImage too, take them for sRGB.
std::string o3de_preset(const TexelLayout& layout) {
  if (layout.type == TexelType::unorm8) return "LUT_RGBA8";
  return layout.channels == 1 ? "LUT_R32F" : layout.channels == 2 ? "LUT_RG32F" : "LUT_RGBA32F";
}

/// Godot's language has one precision in all of a shader, and no word for it where structs are.
std::string without_precision(const std::string& library) {
  std::string out = library;
  for (const std::string_view words :
       {"precision highp float;\n", "precision highp int;\n", "precision mediump float;\n", "highp ", "mediump "})
    for (std::size_t at = out.find(words); at != std::string::npos; at = out.find(words, at))
      out.erase(at, words.size());
  return out;
}

const std::vector<Engine>& all_engines() {
  static const std::vector<Engine> rows = {
      {.id = kPlainEngine,
       .name = "no engine: KTX2 and shader texts",
       .language = "",
       .containers = {"ktx2"},
       .files = {{"README.md", "plain.md"}}},
      {.id = "unreal",
       .name = "Unreal Engine 5",
       .language = "hlsl",
       .containers = {"tga", "png", "exr", "dds"},
       .files = {{"README.md", "unreal.md"}, {"CustomNode.txt", "unreal_node.txt", in_unreal, "LightTS"}},
       .library_file = "Relief.usf",
       .widens_pairs = {TexelType::unorm16, TexelType::float16, TexelType::float32},
       .unreadable = {{"dds", has_blocks, "reads no blocks (BC4, BC5, BC7) from DDS"}},
       .compression = unreal_compression},
      {.id = "unity",
       .name = "Unity 2022.3, URP and Shader Graph",
       .language = "hlsl",
       .containers = {"png", "exr", "dds"},
       .files = {{"README.md", "unity.md"},
                 {"Relief.hlsl", "unity.hlsl", in_shader_graph, "LightTS"},
                 {"ReliefURP.shader", "unity.shader", in_urp}},
       .library_file = "ReliefTrace.hlsl",
       .v_runs_up = true,
       .takes_dds_as_is = true,
       .compression = unity_compression},
      // Its readers of PNG leave 8 bits. Textures of 16-bit integers it has from 4.5 on; DDS of two channels of 8 bits
      // are grey and alpha to it.
      {.id = "godot",
       .name = "Godot 4",
       .language = "glsl_es",
       .containers = {"tga", "exr", "dds"},
       .files = {{"README.md", "godot.md"}, {"relief.gdshader", "godot.gdshader", in_godot}},
       .green_runs_against_v = true,
       .widens_unorm16 = true,
       .takes_dds_as_is = true,
       .widens_pairs = {TexelType::unorm8},
       .adapt = without_precision},
      {.id = "three",
       .name = "three.js with WebGPU",
       .language = "wgsl",
       .containers = {"ktx2"},
       .files = {{"README.md", "three.md"}, {"relief.js", "three.js", as_named}, {"index.html", "three.html"}},
       .library_file = "relief.wgsl",
       .widens_unorm16 = true},
      {.id = "bevy",
       .name = "Bevy 0.17",
       .language = "wgsl",
       .containers = {"ktx2"},
       .files = {{"README.md", "bevy.md"},
                 {"relief_material.rs", "bevy.rs"},
                 {"assets/relief/relief_material.wgsl", "bevy_material.wgsl", as_named}},
       .asset_folder = "assets/relief/",
       .library_file = "assets/relief/relief.wgsl",
       .library_head = "#define_import_path relief::trace\n",
       .green_runs_against_v = true,
       .feature = wgpu_feature},
      {.id = "o3de",
       .name = "O3DE",
       .language = "hlsl",
       .containers = {"tga", "exr", "dds"},
       .files = {{"README.md", "o3de.md"}, {"Relief.azsli", "o3de.azsli", in_o3de}},
       .unreadable = {{"dds", has_levels, "keeps the first level of a DDS alone"},
                      {"dds", is_wide, "takes no DDS but of 8 bits a channel"}},
       .compression = o3de_preset},
  };
  return rows;
}

}  // namespace

std::span<const Engine> engines() { return all_engines(); }

const Engine& find_engine(std::string_view id) { return find_row(all_engines(), "engine", id); }

std::set<std::string> all_export_names() {
  std::set<std::string> names = {"settings.json"};
  for (const Engine& engine : all_engines()) {
    const std::string folder = engine.id == kPlainEngine ? "" : fmt::format("{}/", engine.id);
    for (const EngineFile& file : engine.files) names.insert(fmt::format("{}{}", folder, file.name));
    if (!engine.library_file.empty()) names.insert(fmt::format("{}{}", folder, engine.library_file));
    for (const Container& container : containers())
      for (const char* texture : {"relief", "relief.extra", "relief.normal"})
        names.insert(fmt::format("{}{}{}.{}", folder, engine.asset_folder, texture, container.id));
  }
  for (const Language& language : languages()) {
    names.emplace(language.library_file);
    names.emplace(language.example_file);
  }
  names.erase("");
  return names;
}

}  // namespace reliefbench
