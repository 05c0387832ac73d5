#pragma once
#include <string>
#include <vector>

#include "kernels/image/heightfield.h"
#include "kernels/maps/map_texture.h"
#include "kernels/trace/shader_contract.h"
#include "kernels/trace/technique.h"

namespace reliefbench {

/// What a shipped shader makes up for, since it runs on devices that were not measured: weights of 8 bits, rounded or
/// cut off. GPUs have no fewer.
inline constexpr MapSampler kShippedSampler{.error = {.shift = 0x1p-8}};

/// A texture that a shipped shader binds.
struct ShippedTexture {
  std::string sampler;  ///< its name in the shader
  int binding = 0;
  std::string file;
  const TextureImage* image = nullptr;
  std::string format;    ///< as Vulkan names it: R16G16_UNORM
  std::string channels;  ///< what they hold
};
/// Of a technique that reads a map. textures: must outlive what is returned
[[nodiscard]] std::vector<ShippedTexture> shipped_textures(const Settings& settings, const MapTextures& textures);

struct ShippedShader {
  const Settings& settings;
  std::string heightmap;  ///< as the user named it
  Wrap wrap = Wrap::repeat;
  double relief_depth = 0.1;
  std::vector<ShippedTexture> textures{};  ///< empty where the technique reads no map
};
/// One text of GLSL 4.50 for both dialects, without #version: what its textures are and how it is called as a comment,
/// then the `Hit trace(Ray)` of these settings and `Ray view_ray(...)`, with what they need.
[[nodiscard]] std::string shipped_shader(const ShippedShader& shipped);

}  // namespace reliefbench
