#include "reports/export/shipped_shader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "kernels/base/paper.h"
#include "kernels/trace/shader_contract.h"
#include "reports/export/glsl_text.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/host.h"

namespace reliefbench {
namespace {

constexpr std::size_t kColumns = 120;

/// Words as lines of a comment; the second line on begins with `indent`.
std::string comment(std::string_view words, std::string_view indent = "") {
  std::string out;
  std::string line = "//";
  while (!words.empty()) {
    const std::size_t end = std::min(words.find(' '), words.size());
    if (line.size() + 1 + end > kColumns) {
      out += line + "\n";
      line = fmt::format("//{}", indent);
    }
    line += fmt::format(" {}", words.substr(0, end));
    words.remove_prefix(std::min(end + 1, words.size()));
  }
  return out + line + "\n";
}

/// "r = height (1 = top), g = cone ratio, stored as sqrt"
std::string relief_channels(const MapStorage& storage) {
  std::string text = "r = height, 1 on top";
  if (storage.map.ratios > 0 && storage.format.extra_channels == 0)
    text += fmt::format("; g = cone ratio, stored as {}", storage.encoding.id);
  if (storage.format.with_normal) text += "; b, a = x, y of the normal, each times 0.5 + 0.5";
  return text;
}

std::string extra_channels(const MapStorage& storage) {
  const std::string_view description = storage.map.description;
  switch (storage.map.content) {
    case MapContent::pyramid:
      return fmt::format("r = {}", description);
    case MapContent::volume:
      return fmt::format("r = {}; its slices below one another, the bottom one first", description);
    default:
      return fmt::format("{}, stored as {}: {}", storage.map.ratios == 1 ? "r = cone ratio" : "cone ratios",
                         storage.encoding.id, description);
  }
}

/// Vulkan's name of a texel layout.
std::string format_name(const TexelLayout& layout) {
  const bool is_unorm = layout.type == TexelType::unorm8 || layout.type == TexelType::unorm16;
  std::string name;
  for (const char channel : std::string_view("RGBA").substr(0, static_cast<std::size_t>(layout.channels)))
    name += fmt::format("{}{}", channel, 8 * layout.bytes() / layout.channels);
  return name + (is_unorm ? "_UNORM" : "_SFLOAT");
}

std::string texture_lines(const ShippedShader& shipped) {
  if (shipped.textures.empty()) return "// Textures: none.\n";
  const std::string_view wrap = shipped.wrap == Wrap::repeat ? "repeat" : "clamp to edge";
  std::string text = comment(fmt::format(
      "Textures, linear (no sRGB), filtered bilinearly within a level, levels never mixed, wrap mode {}:", wrap));
  for (const ShippedTexture& texture : shipped.textures)
    text += comment(fmt::format("- {}, binding {}: {}, {} x {}, {} level{}, {}: {}", texture.sampler, texture.binding,
                                texture.file, texture.image->width, texture.image->height, texture.image->levels,
                                texture.image->levels == 1 ? "" : "s", texture.format, texture.channels),
                    "  ");
  return text;
}

std::string guarantee_lines(const Settings& settings) {
  const Technique& technique = settings.technique();
  const Guarantee guarantee = guarantee_of(settings);
  std::string text = fmt::format("Guarantee: {}", guarantee_id(guarantee));
  for (const FeatureRow* row : rows_of(settings))
    if (guarantee != Guarantee::none && !row->caveat.empty()) text += fmt::format(", {}", row->caveat);
  if (makes_up_for_filter(settings))
    text += fmt::format(
        " (SAMPLER_SHIFT, here 1/{} texel along each axis: weights of 8 bits, rounded or cut off; `reliefbench devices "
        "--audit` shows a device's)",
        1 / kShippedSampler.error.shift);
  if (const Guarantee shadow = guarantee_of(settings, Query::shadow); shadow != Guarantee::none)
    text += fmt::format("; of shadow rays: {}", guarantee_id(shadow));
  if (!technique.guarantee_note.empty()) text += fmt::format(". Of {}: {}", technique.id, technique.guarantee_note);
  return comment(text + ".");
}

std::string use_lines(const ShippedShader& shipped) {
  std::string text = "// In a fragment shader of `#version 450`, for OpenGL or Vulkan:\n";
  if (shipped.wrap == Wrap::clamp)
    text += "//   if (any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0)))) discard;\n";
  text += fmt::format("//   Ray ray = view_ray(uv, view, {:#});\n", shipped.relief_depth);
  if (reads_levels(shipped.settings)) text += "//   ray.footprint = pixel_footprint(uv);\n";
  text +=
      "//   Hit hit = trace(ray);\n"
      "//   vec2 hit_uv = ray.uv + ray.slope * hit.t;  // for other maps, by textureGrad(map, hit_uv, dFdx(uv), "
      "dFdy(uv))\n";
  const std::vector<PixelFeature> features = pixel_features(shipped.settings);
  if (!features.empty())
    text += fmt::format(
        "//   Scene scene = Scene(light, light_radius, {:#});  // light: unit, towards it, in tangent space; the "
        "radius: "
        "its\n"
        "//                                                    // angular radius' tangent\n",
        shipped.relief_depth);
  for (const PixelFeature& one : features)
    text += fmt::format("//   float {0} = relief_{0}(ray, scene, hit);  // {1}\n", one.feature->id,
                        one.feature->value->meaning);
  return text;
}

/// Text from outside as it may stand in a comment.
std::string on_one_line(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  return text;
}

std::string header(const ShippedShader& shipped) {
  const Technique& technique = shipped.settings.technique();
  std::string text =
      comment(fmt::format("{}: {}.{}{}", technique.id, technique.description,
                          technique.source == "-" ? "" : " Source: ", technique.source == "-" ? "" : technique.source));
  for (const Paper& paper : papers_cited_by(technique.source))
    text += comment(fmt::format("[{}] {}{}{}, {}", paper.id, paper.authors, paper.authors.empty() ? "" : ": ",
                                paper.title, paper.where),
                    "  ");
  text += fmt::format("//\n// Setting, for {}, wrap {}:\n//   {}\n", on_one_line(shipped.heightmap),
                      shipped.wrap == Wrap::repeat ? "repeat" : "clamp", setting_id(shipped.settings));
  text += "//\n" + texture_lines(shipped) + "//\n" + guarantee_lines(shipped.settings) + "//\n" + use_lines(shipped);
  return text + fmt::format("//\n// Exported by reliefbench {} ({}).\n", version(), git_sha());
}

}  // namespace

std::vector<ShippedTexture> shipped_textures(const Settings& settings, const MapTextures& textures) {
  const MapStorage storage = storage_of(settings);
  std::vector<ShippedTexture> list = {{.sampler = kReliefMap,
                                       .binding = binding_of(kReliefMap),
                                       .file = "relief.ktx2",
                                       .image = &textures.relief,
                                       .format = format_name(textures.relief.layout),
                                       .channels = relief_channels(storage)}};
  if (textures.extra)
    list.push_back({.sampler = kExtraMap,
                    .binding = binding_of(kExtraMap),
                    .file = "relief.extra.ktx2",
                    .image = &*textures.extra,
                    .format = format_name(textures.extra->layout),
                    .channels = extra_channels(storage)});
  return list;
}

std::string shipped_shader(const ShippedShader& shipped) {
  const Technique& technique = shipped.settings.technique();
  GlslCut cut{.files = {"common.glsl", "parameters.glsl", fmt::format("{}.glsl", technique.id)},
              .roots = {"trace", "view_ray"},
              .generated = {{"contract.glsl", shared_contract()}, {"parameters.glsl", parameters_contract(technique)}}};
  const std::vector<PixelFeature> features = pixel_features(shipped.settings);
  cut.files.emplace_back("feature_parameters.glsl");
  cut.generated.emplace("feature_parameters.glsl", feature_parameters(features));
  for (const PixelFeature& one : features) cut.roots.insert(fmt::format("relief_{}", one.feature->id));
  for (const FeatureRow* row : rows_of(shipped.settings))
    if (!row->shader.empty()) cut.files.emplace_back(row->shader);
  cut.files.emplace_back("ship.glsl");
  if (reads_levels(shipped.settings)) cut.roots.insert("pixel_footprint");
  for (const SpecConstant& constant : constants_of(&shipped.settings, shipped.wrap, kShippedSampler))
    cut.constants[static_cast<int>(constant.id)] = constant.value;
  return header(shipped) + "\n" + cut_glsl(cut);
}

}  // namespace reliefbench
