#pragma once
#include <string>
#include <vector>

#include "kernels/image/heightfield.h"
#include "kernels/maps/map_texture.h"
#include "kernels/trace/shader_contract.h"
#include "kernels/trace/technique.h"
#include "reports/export/shader_rewrite.h"

namespace reliefbench {

/// What a shipped shader makes up for, since it runs on devices that were not measured: weights of 8 bits, rounded or
/// cut off. GPUs have no fewer.
inline constexpr MapSampler kShippedSampler{.error = {.shift = 0x1p-8}};

/// A texture that a shipped shader reads.
struct ShippedTexture {
  std::string sampler;  ///< its name in the shader
  int binding = 0;      ///< in the examples
  std::string file;     ///< without extension
  const TextureImage* image = nullptr;
  std::string format;    ///< as Vulkan names it: R16G16_UNORM
  std::string channels;  ///< what they hold
};
/// Of a technique that reads a map. textures: must outlive what is returned
[[nodiscard]] std::vector<ShippedTexture> shipped_textures(const Settings& settings, const MapTextures& textures);
/// Vulkan's name of a texel layout.
[[nodiscard]] std::string format_name(const TexelLayout& layout);

struct ShippedShader {
  const Settings& settings;
  std::string heightmap;  ///< as the user named it
  Wrap wrap = Wrap::repeat;
  double relief_depth = 0.1;
  double base = 1;                         ///< Scene::base
  float light_radius = 0;                  ///< tangent of the light's angular radius, as frames have it
  std::vector<ShippedTexture> textures{};  ///< empty where the technique reads no map
};

/// The light's radius as calls of relief_trace pass it.
[[nodiscard]] std::string light_radius_text(const ShippedShader& shipped);

/// Whether relief_trace looks at the size of a pixel on the plane.
[[nodiscard]] bool takes_derivatives(const Settings& settings);

/// Whether relief_trace bends rays, so that it is told how the surface does.
[[nodiscard]] bool takes_curvature(const Settings& settings);

/// Whether its rays begin elsewhere in each frame, so that the example is told the frame's number.
[[nodiscard]] bool is_animated(const Settings& settings);

/// Whether a view may see nothing of the relief.
[[nodiscard]] bool may_pass(const ShippedShader& shipped);

/// Functions that others call, in every language.
[[nodiscard]] std::set<std::string> shipped_entries(const ShippedShader& shipped);

/// What every language is written from: GLSL 4.50 with `ReliefSurface relief_trace(...)` of these settings and
/// `relief_normal(...)`, with what they need; all of it under one prefix, maps as arguments.
[[nodiscard]] Pieces shipped_source(const ShippedShader& shipped, MapArguments arguments);
/// The maps that a function of that text has as its first arguments.
[[nodiscard]] std::vector<std::string> map_arguments(const Pieces& source, std::string_view function);
/// A whole fragment shader round that: `#version`, the text, bindings, one lit pixel.
[[nodiscard]] std::string example_shader(const ShippedShader& shipped, const Pieces& source, MapArguments arguments);

/// A comment on top of each text: licence, technique, textures, guarantee, use. All languages have `//`.
/// language: its name
[[nodiscard]] std::string shipped_header(const ShippedShader& shipped, std::string_view language);

/// Text from outside as it may stand in a comment or a sheet: control characters are spaces.
[[nodiscard]] std::string on_one_line(std::string text);

}  // namespace reliefbench
