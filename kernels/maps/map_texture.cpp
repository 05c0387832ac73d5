#include "kernels/maps/map_texture.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <utility>

#include "kernels/base/parallel.h"
#include "kernels/image/heightmap.h"
#include "kernels/maps/block_codec.h"
#include "kernels/maps/cell_map.h"
#include "kernels/maps/distance_map.h"
#include "kernels/maps/mip_chain.h"
#include "kernels/maps/omni_table.h"
#include "kernels/maps/sector_map.h"

namespace reliefbench {
namespace {

// The first bytes of a little-endian code are its low ones, and GPUs read texels in the host's order.
static_assert(std::endian::native == std::endian::little);

std::size_t texel_count(int width, int height) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

/// Levels down to 1 x 1.
int chain_length(const Heightfield& heights) {
  return static_cast<int>(std::bit_width(static_cast<unsigned>(std::max(heights.width, heights.height))));
}

/// Of blocks: what they are made from, codes of whole texels.
TextureImage blank(int width, int height, const TexelLayout& layout, int levels = 1) {
  TextureImage image{.width = width, .height = height, .layout = layout, .levels = levels};
  std::size_t texels = 0;
  for (int l = 0; l < levels; ++l) texels += texel_count(level_side(width, l), level_side(height, l));
  image.texels.resize(texels * static_cast<std::size_t>(layout.bytes()));
  return image;
}

/// Bytes of a channel, and where it begins in texel `texel`, counted over all levels.
struct Place {
  std::size_t offset, size;
};
Place place_of(const TexelLayout& layout, std::size_t texel, int channel) {
  const auto channels = static_cast<std::size_t>(layout.channels);
  const std::size_t size = static_cast<std::size_t>(layout.bytes()) / channels;
  return {.offset = (texel * channels + static_cast<std::size_t>(channel)) * size, .size = size};
}

void write_code(TextureImage& image, std::size_t texel, int channel, std::uint32_t code) {
  const Place place = place_of(image.layout, texel, channel);
  std::memcpy(image.texels.data() + place.offset, &code, place.size);
}

float read_value(const TextureImage& image, std::size_t texel, int channel) {
  const Place place = place_of(image.layout, texel, channel);
  std::uint32_t code = 0;
  std::memcpy(&code, image.texels.data() + place.offset, place.size);
  return value_of(code, image.layout.type);
}

template <typename Texel>
void for_each_texel(const Heightfield& heights, const Texel& texel) {
  const auto row_texels = static_cast<std::size_t>(heights.width);
  parallel_for(heights.height, 0, [&](int y) {
    const std::size_t begin = static_cast<std::size_t>(y) * row_texels;
    for (std::size_t i = begin; i < begin + row_texels; ++i) texel(i);
  });
}

/// first: texel of the image where the level begins.
void write_heights(TextureImage& image, const Heightfield& heights, std::size_t first = 0) {
  for_each_texel(heights, [&](std::size_t i) {
    write_code(image, first + i, 0, nearest_code(heights.texels[i], image.layout.type));
  });
}

void write_normals(TextureImage& image, const MapSource& source) {
  const std::vector<std::uint8_t> normals = normal_map(source.heights, source.wrap, source.relief_depth);
  for_each_texel(source.heights, [&](std::size_t i) {
    write_code(image, i, 2, normals[4 * i]);
    write_code(image, i, 3, normals[4 * i + 1]);
  });
}

/// Channel of the first ratio, in the texture that holds them; floors come before.
int first_ratio(const Format& format, bool is_solid) {
  return (format.extra_channels > 0 ? 0 : 1) + (is_solid ? 1 : 0);
}

/// How ratios are kept.
struct RatioLayout {
  const MapRow& map;
  const Format& format;
  const Encoding& encoding;
};

void write_ratios(MapTextures& textures, const Heightfield& heights, std::span<const float> values,
                  const RatioLayout& layout, std::size_t first_texel = 0) {
  const int have = layout.map.ratios;
  const Format& format = layout.format;
  const int first = first_ratio(format, layout.map.is_solid);
  TextureImage& image = format.extra_channels > 0 ? *textures.extra : textures.relief;
  for_each_texel(heights, [&](std::size_t i) {
    for (int k = 0; k < format.ratios() - (layout.map.is_solid ? 1 : 0); ++k) {
      const float ratio = k < have ? values[i * static_cast<std::size_t>(have) + static_cast<std::size_t>(k)] : 0;
      write_code(image, first_texel + i, first + k,
                 floor_code(ratio, cone_height(heights, i, k), format.type, layout.encoding));
    }
  });
}

void write_floors(MapTextures& textures, const Heightfield& heights, const Format& format) {
  TextureImage& image = format.extra_channels > 0 ? *textures.extra : textures.relief;
  const int channel = first_ratio(format, false);
  for_each_texel(heights, [&](std::size_t i) {
    write_code(image, i, channel, nearest_code(heights.floors[i], image.layout.type));
  });
}

/// Each level of the one before as blocks have it, so that they round no level under the one before.
void write_block_mips(MapTextures& textures, const MapSource& source, const RatioLayout& layout) {
  const BlockRounding rounding = source.mips == Mips::mean ? BlockRounding::nearest : BlockRounding::above;
  std::size_t first = 0;
  MipLevel level{.heights = source.heights, .ratios = {source.values.begin(), source.values.end()}};
  for (int l = 1; l < textures.relief.levels; ++l) {
    first += level.heights.texels.size();
    level = mip_chain(level.heights, level.ratios, layout.map.ratios, source.wrap, source.mips).front();
    level.heights = heights_in_blocks(level.heights, layout.format.type, rounding);
    write_heights(textures.relief, level.heights, first);
    write_ratios(textures, level.heights, level.ratios, layout, first);
  }
}

/// The coarse levels of a map of heights and ratios. Normals are looked up in the base alone.
void write_mips(MapTextures& textures, const MapSource& source, const RatioLayout& layout) {
  std::size_t first = source.heights.texels.size();
  for (const MipLevel& level : mip_chain(source.heights, source.values, layout.map.ratios, source.wrap, source.mips)) {
    write_heights(textures.relief, level.heights, first);
    write_ratios(textures, level.heights, level.ratios, layout, first);
    first += level.heights.texels.size();
  }
}

/// To the nearest. Maxima of stored heights are stored heights: of a pyramid nothing is rounded.
void write_values(TextureImage& image, std::span<const float> values) {
  const auto channels = static_cast<std::size_t>(image.layout.channels);
  assert(values.size() * static_cast<std::size_t>(image.layout.bytes()) == image.texels.size() * channels);
  for (std::size_t i = 0; i < values.size(); ++i)
    write_code(image, i / channels, static_cast<int>(i % channels), nearest_code(values[i], image.layout.type));
}

/// The slices of a volume.
VolumeAtlas atlas_of(const MapSource& source) {
  const auto slices = static_cast<int>(source.values.size() / source.heights.texels.size());
  return {slices, source.heights.width, source.heights.height};
}

/// As VolumeAtlas lays the slices out; distances are rounded down.
void write_volume(TextureImage& image, const MapSource& source) {
  const auto width = static_cast<std::size_t>(source.heights.width);
  const auto height = static_cast<std::size_t>(source.heights.height);
  const std::size_t lines = source.values.size() / width;  // of all slices
  const auto columns = static_cast<std::size_t>(atlas_of(source).columns);
  parallel_for(static_cast<int>(lines), 0, [&](int line) {
    const auto [slice, y] = std::pair(static_cast<std::size_t>(line) / height, static_cast<std::size_t>(line) % height);
    const std::size_t first = ((slice / columns * height + y) * columns + slice % columns) * width;
    for (std::size_t x = 0; x < width; ++x) {
      const float value = source.values[static_cast<std::size_t>(line) * width + x];
      const std::uint32_t code = nearest_code(value, image.layout.type);
      write_code(image, first + x, 0, value_of(code, image.layout.type) > value ? code - 1 : code);
    }
  });
}

/// Column and row of a layer's first texel in the atlas, inside its border.
struct LayerPlace {
  int x, y;
};
LayerPlace place_of_layer(const SectorAtlas& atlas, int layer, int width, int height) {
  return {.x = layer % atlas.columns * (width + 2) + 1, .y = layer / atlas.columns * (height + 2) + 1};
}

/// Every layer with its border.
void write_sectors(TextureImage& image, const MapSource& source, const Encoding& encoding) {
  const Heightfield& heights = source.heights;
  const std::vector<float> apexes = source.map.is_of_cells ? cell_tops(heights, source.wrap, 0) : heights.texels;
  const int count = sector_count(source.parameters);
  const SectorAtlas atlas(count, heights.width, heights.height);
  const TexelType type = image.layout.type;
  const bool has_opposite = has_opposite_ratios(source.parameters);
  assert(source.values.size() == heights.texels.size() * static_cast<std::size_t>(count));
  const auto layer_ratios = [&](int k) {
    return source.values.subspan(static_cast<std::size_t>(k) * heights.texels.size());
  };
  parallel_for(count * heights.height, 0, [&](int row) {
    const int layer = row / heights.height;
    const int y = row % heights.height;
    const LayerPlace place = place_of_layer(atlas, layer, heights.width, heights.height);
    const auto ratios = layer_ratios(layer);
    const auto opposite = layer_ratios(layer ^ (has_opposite ? kOpposite : 0));
    for (int x = 0; x < heights.width; ++x) {
      const std::size_t texel = texel_count(heights.width, y) + static_cast<std::size_t>(x);
      const float height = apexes[texel];
      const std::uint32_t height_code = nearest_code(height, type);
      const std::uint32_t ratio_code = floor_code(ratios[texel], height, type, encoding);
      const std::uint32_t opposite_code = has_opposite ? floor_code(opposite[texel], height, type, encoding) : 0;
      // The texel, and where it stands in for one on the other side of the border.
      for (const int j : {-1, y, heights.height}) {
        if (wrapped(j, heights.height, source.wrap) != y) continue;
        for (const int i : {-1, x, heights.width}) {
          if (wrapped(i, heights.width, source.wrap) != x) continue;
          const std::size_t to = texel_count(atlas.width, place.y + j) + static_cast<std::size_t>(place.x + i);
          write_code(image, to, 0, height_code);
          write_code(image, to, 1, ratio_code);
          if (has_opposite) write_code(image, to, 2, opposite_code);
        }
      }
    }
  });
}

/// One layer of an atlas, without its border.
TextureImage unpacked_layer(const TextureImage& image, const SectorAtlas& atlas, int layer, int width, int height) {
  TextureImage result = blank(width, height, image.layout);
  const LayerPlace place = place_of_layer(atlas, layer, width, height);
  const auto bytes = static_cast<std::size_t>(image.layout.bytes());
  for (int y = 0; y < height; ++y) {
    const std::size_t from = texel_count(atlas.width, place.y + y) + static_cast<std::size_t>(place.x);
    std::memcpy(result.texels.data() + texel_count(width, y) * bytes, image.texels.data() + from * bytes,
                static_cast<std::size_t>(width) * bytes);
  }
  return result;
}

}  // namespace

std::vector<MapTextures> cone_layers(const MapRow& map, const MapTextures& textures,
                                     std::span<const MapValue> parameters) {
  if (map.content != MapContent::sectors) return {textures};
  const int width = textures.relief.width;
  const int height = textures.relief.height;
  const int count = sector_count(parameters);
  const SectorAtlas atlas(count, width, height);
  std::vector<MapTextures> layers;
  layers.reserve(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k)
    layers.push_back({.relief = unpacked_layer(textures.extra.value(), atlas, k, width, height)});
  return layers;
}

MapTextures pack_heights(const Heightfield& heights, const Format& format) {
  MapTextures textures{.relief = blank(heights.width, heights.height, format.relief())};
  write_heights(textures.relief, heights);
  if (is_of_blocks(format.type))
    textures.relief = as_blocks(textures.relief, BlockRounding::nearest, BlockRounding::below);
  return textures;
}

namespace {

/// The texture beside the relief, where there is one, of zeros.
std::optional<TextureImage> blank_extra(const MapSource& source, const Format& format, int levels) {
  const auto& [width, height] = std::pair(source.heights.width, source.heights.height);
  switch (source.map.content) {
    case MapContent::heights:
    case MapContent::ratios:
      if (format.extra_channels == 0) return std::nullopt;
      return blank(width, height, format.extra(), levels);
    case MapContent::pyramid:
      return blank(width, height, format.relief(), chain_length(source.heights));
    case MapContent::volume: {
      const VolumeAtlas atlas = atlas_of(source);
      return blank(atlas.columns * width, atlas.rows * height, format.relief());
    }
    case MapContent::table: {
      const OmniTable table(source.parameters);
      return blank(table.width(), table.height(), format.relief());
    }
    case MapContent::sectors: {
      const SectorAtlas atlas(sector_count(source.parameters), width, height);
      return blank(
          atlas.width, atlas.height,
          has_opposite_ratios(source.parameters) ? TexelLayout{.type = format.type, .channels = 4} : format.relief());
    }
  }
  return std::nullopt;
}

/// Of blocks: what they are made from.
MapTextures packed_texels(const MapSource& source, const Format& format, const Encoding& encoding) {
  const auto& [map, heights, values, wrap, depth, mips, parameters] = source;
  MapTextures textures = blank_textures(source, format);
  write_heights(textures.relief, heights);
  if (format.with_normal) write_normals(textures.relief, source);
  if (map.is_solid) write_floors(textures, heights, format);
  const RatioLayout layout{.map = map, .format = format, .encoding = encoding};
  switch (map.content) {
    case MapContent::heights:
      break;
    case MapContent::ratios:
      assert(values.size() == heights.texels.size() * static_cast<std::size_t>(map.ratios));
      write_ratios(textures, heights, values, layout);
      break;
    case MapContent::pyramid:
    case MapContent::table:
      write_values(*textures.extra, values);
      break;
    case MapContent::volume:
      write_volume(*textures.extra, source);
      break;
    case MapContent::sectors:
      write_sectors(*textures.extra, source, encoding);
      break;
  }
  if (textures.relief.levels > 1) (is_of_blocks(format.type) ? write_block_mips : write_mips)(textures, source, layout);
  return textures;
}

/// Ratios that hold if heights are up to value_spread() off, a texel or more away.
std::vector<float> narrowed_for_spread(const MapSource& source, TexelType type) {
  const auto side = static_cast<float>(std::max(source.heights.width, source.heights.height));
  const float share = 2 * value_spread(type) * side;  // by which a slope of 1 may grow
  std::vector<float> ratios(source.values.begin(), source.values.end());
  for (float& ratio : ratios) ratio /= 1 + share * ratio;
  return ratios;
}

}  // namespace

MapTextures blank_textures(const MapSource& source, const Format& format) {
  const MapContent content = source.map.content;
  const bool has_levels =
      source.mips != Mips::none && (content == MapContent::heights || content == MapContent::ratios);
  const int levels = has_levels ? chain_length(source.heights) : 1;
  const TexelLayout relief =
      content == MapContent::sectors ? TexelLayout{.type = format.type, .channels = 1} : format.relief();
  return {.relief = blank(source.heights.width, source.heights.height, relief, levels),
          .extra = blank_extra(source, format, levels)};
}

MapTextures pack_map(const MapSource& source, const Format& format, const Encoding& encoding) {
  if (!is_of_blocks(format.type)) return packed_texels(source, format, encoding);
  const std::vector<float> ratios = narrowed_for_spread(source, format.type);
  MapSource narrowed = source;
  narrowed.values = ratios;
  const MapTextures codes = packed_texels(narrowed, format, encoding);
  // The safe side of a ratio is the narrower cone.
  return {.relief = as_blocks(codes.relief, BlockRounding::nearest,
                              encoding.is_decreasing ? BlockRounding::above : BlockRounding::below)};
}

UnpackedMap unpack_map(const MapTextures& textures, const Format& format, const Encoding& encoding, bool is_solid) {
  const TextureImage& relief = textures.relief;
  UnpackedMap unpacked{.heights = {.width = relief.width, .height = relief.height, .texels = read_channel(relief, 0)},
                       .ratios = {}};
  const TextureImage& image = format.extra_channels > 0 ? textures.extra.value() : relief;
  const int first = first_ratio(format, is_solid);
  if (is_solid) unpacked.heights.floors = read_channel(image, first - 1);
  const int ratios = format.ratios() - (is_solid ? 1 : 0);
  std::vector<std::vector<float>> stored;
  stored.reserve(static_cast<std::size_t>(ratios));
  for (int k = 0; k < ratios; ++k) stored.push_back(read_channel(image, first + k));
  for (std::size_t i = 0; i < unpacked.heights.texels.size(); ++i)
    for (int k = 0; k < ratios; ++k)
      unpacked.ratios.push_back(
          encoding.decode(stored[static_cast<std::size_t>(k)][i], cone_height(unpacked.heights, i, k)));
  return unpacked;
}

std::vector<float> read_channel(const TextureImage& image, int channel, int level) {
  if (is_of_blocks(image.layout.type)) return read_blocks(image, channel, level);
  std::size_t begin = 0;
  for (int l = 0; l < level; ++l) begin += texel_count(level_side(image.width, l), level_side(image.height, l));
  std::vector<float> values(texel_count(level_side(image.width, level), level_side(image.height, level)));
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = read_value(image, begin + i, channel);
  return values;
}

}  // namespace reliefbench
