#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "backends/gpu_bake.h"
#include "kernels/maps/map_texture.h"

namespace reliefbench {

/// The values that a bake leaves in a buffer: of texel or node i, the k-th is at i * texel_stride + k * ratio_stride.
struct ValueLayout {
  int texel_stride = 1;
  int ratio_stride = 0;
};

/// The Pack block of bake_pack.comp, laid out by std140: what one texture is made of.
struct BakePack {
  double relief_depth = 0;
  std::array<std::int32_t, 2> layers{};   ///< of a sector map, across and in all; none: texels are the map's, or nodes
  std::array<std::int32_t, 4> sources{};  ///< PackSource of each channel
  std::array<std::int32_t, 4> places{};   ///< which of them; a ratio of -1 is 0
  std::int32_t channels = 1;
  std::int32_t texels = 0;
  std::int32_t first_word = 0;  ///< in the buffer of all textures
  std::int32_t flag_word = 0;   ///< there: whether a ratio was cut short
  std::int32_t texel_stride = 1;
  std::int32_t ratio_stride = 0;
  std::int32_t is_of_cells = 0;
  std::int32_t is_solid = 0;
};

/// In place of an argument: clears the flag, and does nothing else.
inline constexpr int kClearFlag = -1;

/// Textures in one buffer of words.
struct PackPlan {
  std::vector<BakePack> textures;
  std::int32_t words = 0;  ///< the last one is the flag
};
/// blank: what blank_textures() makes of the source
[[nodiscard]] PackPlan pack_plan(const MapSource& source, const Format& format, const MapTextures& blank,
                                 const ValueLayout& layout);
/// Invocations of the shader for a texture.
[[nodiscard]] int pack_invocations(const BakePack& pack);
/// From the buffer's bytes. textures: blank before
void fill_textures(MapTextures& textures, const PackPlan& plan, const std::vector<std::byte>& bytes);
[[nodiscard]] bool was_cut_short(const PackPlan& plan, const std::vector<std::byte>& bytes);

/// What bake_pack.comp has of a format and an encoding, as GLSL: a part of bake_contract.glsl.
[[nodiscard]] std::string pack_contract(const BakePacking& packing);

}  // namespace reliefbench
