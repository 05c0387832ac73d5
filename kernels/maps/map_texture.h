#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "kernels/image/texture_image.h"
#include "kernels/maps/map_kind.h"
#include "kernels/maps/mip_chain.h"
#include "kernels/maps/texel.h"

namespace reliefbench {

/// A relief map as the shaders have it.
struct MapTextures {
  TextureImage relief;
  std::optional<TextureImage> extra{};
  [[nodiscard]] std::size_t bytes() const { return relief.texels.size() + (extra ? extra->texels.size() : 0); }
};

/// What is packed. values: what the map kind's baker returned for these heights.
struct MapSource {
  const MapRow& map;
  const Heightfield& heights;  ///< already quantised by quantise_heights for format.type
  std::span<const float> values;
  Wrap wrap = Wrap::repeat;
  double relief_depth = 0.1;               ///< of the scene, for a format with normals
  Mips mips = Mips::none;                  ///< levels of mip_chain(), for heights and ratios; pyramids have their own
  std::span<const MapValue> parameters{};  ///< of the map's own, which a table has its size from
};

/// Ratios are floored here (floor_ratio; of blocks, to the nearest block below), pyramids rounded up, volumes down,
/// tables to the nearest. Where a format has more ratio channels than the map, those are 0.
[[nodiscard]] MapTextures pack_map(const MapSource& source, const Format& format, const Encoding& encoding);

/// Textures as pack_map() makes them, of zeros; of blocks, what those are made from. Values: of a volume alone.
[[nodiscard]] MapTextures blank_textures(const MapSource& source, const Format& format);

/// Its cones as textures of one map each, height and ratio in a texel: the layers of a sector map, without their
/// borders; of another map itself.
[[nodiscard]] std::vector<MapTextures> cone_layers(const MapRow& map, const MapTextures& textures,
                                                   std::span<const MapValue> parameters);

/// Heights alone.
[[nodiscard]] MapTextures pack_heights(const Heightfield& heights, const Format& format);

/// Decodes packed textures again (tests, --verify): what the shader sees at texel centres.
struct UnpackedMap {
  Heightfield heights;
  std::vector<float> ratios;  ///< Format::ratios() a texel, interleaved; of a solid one less, its floors taken off
};
/// is_solid: the map's heights have floors
[[nodiscard]] UnpackedMap unpack_map(const MapTextures& textures, const Format& format, const Encoding& encoding,
                                     bool is_solid = false);
/// What a ratio of a solid's map is decoded with: of the first one the top, of the second one the mirrored floor.
[[nodiscard]] inline float cone_height(const Heightfield& heights, std::size_t texel, int ratio) {
  return heights.is_solid() && ratio == 1 ? 1.0F - heights.floors[texel] : heights.texels[texel];
}

/// One channel of one level, decoded from its texel type.
[[nodiscard]] std::vector<float> read_channel(const TextureImage& image, int channel, int level = 0);

}  // namespace reliefbench
