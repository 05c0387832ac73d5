#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "kernels/base/paper.h"
#include "reports/export/shipped_shader.h"
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

std::string texture_lines(const ShippedShader& shipped) {
  if (shipped.textures.empty()) return "// Textures: none.\n";
  const std::string_view wrap = shipped.wrap == Wrap::repeat ? "repeat" : "clamp to edge";
  std::string text = comment(fmt::format(
      "Textures, linear (no sRGB), filtered bilinearly within a level, levels never mixed, wrap mode {}:", wrap));
  for (const ShippedTexture& texture : shipped.textures)
    text += comment(fmt::format("- {}: {}, {} x {}, {} level{}, {}: {}", texture.sampler, texture.file,
                                texture.image->width, texture.image->height, texture.image->levels,
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
  std::string text = "// relief_trace, called once a fragment, finds what it shows: a ReliefSurface. Its arguments:\n";
  const auto add = [&](std::string_view name, std::string_view words) {
    text += comment(fmt::format("- {}: {}", name, words), "  ");
  };
  if (!shipped.textures.empty())
    add("maps", "the textures above, with their samplers where the language has those apart");
  if (is_dithered(shipped.settings))
    add("dither_phase",
        frames_seen(shipped.settings) == 1
            ? "where in its first step the ray begins, 0 to 1, another for each pixel: relief_dither of the pixel and 0"
            : fmt::format("where in its first step the ray begins, 0 to 1, another for each pixel and frame: "
                          "relief_dither of the pixel and the frame's number, 0 to {} time and again. What was "
                          "measured is the mean of those frames, as temporal anti-aliasing makes it",
                          kDitherFrames - 1));
  add("uv", "where the view meets the plane, in tiles");
  add("view_ts",
      fmt::format("from the eye to there, in tangent space (x along u, y along v, z out of the plane), {}; z < 0",
                  shipped.settings.is("fade", "distance") ? "in sides of a tile" : "of any length"));
  add("relief_depth",
      fmt::format("from the relief's top to its bottom, in sides of a tile; measured with {:#}. The plane lies at {}",
                  shipped.relief_depth,
                  shipped.base == 1 ? "the top" : fmt::format("the height {:#} of 0 to 1", shipped.base)));
  const std::vector<PixelFeature> features = pixel_features(shipped.settings);
  if (takes_curvature(shipped.settings))
    add("curvature",
        "of the surface there, per side of a tile, as a quadric under its tangent plane: x along u, y along v, z of "
        "the product of both ways, so that what is w away in the plane lies (x w.x^2 + y w.y^2 + z w.x w.y) / 2 over "
        "the surface; > 0 where it bends away. A ball of radius r: 1 / r, 1 / r, 0; a mesh: fitted at each corner to "
        "its neighbours by least squares, as [RTM] listing 5.8 does");
  if (has_value_of(shipped.settings, Query::shadow)) {
    add("light_ts", "towards the light's middle, in tangent space, of length 1");
    add("light_radius",
        fmt::format("tangent of the light's angular radius; 0: a point; measured with {}", light_radius_text(shipped)));
  }
  if (has_value_of(shipped.settings, Query::depth)) {
    add("planes", "near and far plane, along the camera's axis");
    add("eye_depth",
        "along that axis: of the fragment, 1 / gl_FragCoord.w, and what is added as far as the bottom of the relief: "
        "the former times the relief's depth over the eye's height over the plane");
  }
  text += comment(
      "Of the surface: uv of the hit for other maps, best read with the gradients of the plane's uv; height, 0 "
      "to 1; whether the view hit it within the steps; depth_offset, from the plane to the hit along the view, in "
      "sides of a tile, below 0 in front of the plane; taps, texture instructions.");
  if (may_pass(shipped))
    text += comment("passes: the view leaves the relief without a hit, and what stands behind is seen.");
  for (const PixelFeature& one : features)
    text += comment(fmt::format("{}: {}.", one.feature->id, one.feature->value->meaning));
  if (!shipped.textures.empty())
    text +=
        comment("relief_normal gives the unit normal at the hit's uv from the heights, for whom has no normal map.");
  if (is_by_compute(shipped.settings))
    text += comment("Measured in a compute shader, groups of 8x8 pixels: a fragment here is an invocation there.");
  if (takes_derivatives(shipped.settings))
    text += comment("relief_trace takes derivatives of uv: call it in uniform control flow.");
  if (const Param* normals = shipped.settings.active("normals");
      normals != nullptr && shipped.settings.get("normals") != 0)
    text += comment(
        fmt::format("Normals were read {}: give the normal map mip levels, and its look-up at the hit's uv {}.",
                    shipped.settings.is("normals", "footprint") ? "by the pixel's size on the plane"
                                                                : "by the derivatives of the hit's uv",
                    shipped.settings.is("normals", "footprint") ? "the gradients of the plane's uv" : "no gradients"));
  if (shipped.wrap == Wrap::clamp) text += comment("The relief ends where uv leaves 0 to 1: discard such fragments.");
  return text;
}

}  // namespace

std::string on_one_line(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  return text;
}

std::string shipped_header(const ShippedShader& shipped, std::string_view language) {
  const Technique& technique = shipped.settings.technique();
  std::string text =
      comment(fmt::format("Relief mapping in {}, exported by reliefbench {} ({}).", language, version(), git_sha()));
  text += "// SPDX-License-Identifier: MIT-0 (use it for anything, without conditions and without warranty)\n//\n";
  text +=
      comment(fmt::format("{}: {}.{}{}", technique.id, technique.description,
                          technique.source == "-" ? "" : " Source: ", technique.source == "-" ? "" : technique.source));
  std::string sources(technique.source);
  for (const FeatureRow* row : rows_of(shipped.settings)) sources += row->source;
  for (const Paper& paper : papers_cited_by(sources))
    text += comment(fmt::format("[{}] {}{}{}, {}", paper.id, paper.authors, paper.authors.empty() ? "" : ": ",
                                paper.title, paper.where),
                    "  ");
  text += fmt::format("//\n// Setting, for {}, wrap {}:\n//   {}\n", on_one_line(shipped.heightmap),
                      wrap_id(shipped.wrap), setting_id(shipped.settings));
  return text + "//\n" + texture_lines(shipped) + "//\n" + guarantee_lines(shipped.settings) + "//\n" +
         use_lines(shipped);
}

}  // namespace reliefbench
