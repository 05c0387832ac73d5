#include "backends/gpu_bake_pack.h"

#include <fmt/format.h>

#include <cstring>
#include <utility>

#include "kernels/maps/sector_map.h"

namespace reliefbench {
namespace {

enum class PackSource : std::int32_t { height, floor, node, ratio, normal };

constexpr int kTexelsTogether = 4;  // of one invocation: whole words, whatever the format

int bits_of_code(TexelType type) { return 8 * TexelLayout{.type = type, .channels = 1}.bytes(); }

/// Of all levels. Bytes may be more than an int holds.
int texels_of(const TextureImage& image) {
  return static_cast<int>(image.texels.size() / static_cast<std::size_t>(image.layout.bytes()));
}

/// Invocations leave as many words as a texel has bytes.
int words_of(const BakePack& pack, const TextureImage& image) { return pack_invocations(pack) * image.layout.bytes(); }
static_assert(kTexelsTogether == sizeof(std::uint32_t));

/// A channel of a texture: what is in it, and which of them.
using PackChannel = std::pair<PackSource, int>;

std::vector<PackChannel> relief_channels(const MapSource& source, const Format& format) {
  std::vector<PackChannel> channels{{PackSource::height, 0}};
  if (source.map.content == MapContent::sectors) return channels;
  const bool is_split = format.extra_channels > 0;
  if (source.map.is_solid && !is_split) channels.emplace_back(PackSource::floor, 0);
  if (format.with_normal)
    channels.insert(
        channels.end(),
        {{PackSource::ratio, source.map.ratios > 0 ? 0 : -1}, {PackSource::normal, 0}, {PackSource::normal, 1}});
  return channels;
}

std::vector<PackChannel> extra_channels(const MapSource& source) {
  std::vector<PackChannel> channels;
  switch (source.map.content) {
    case MapContent::pyramid:
      for (int k = 0; k <= (source.map.is_solid ? 1 : 0); ++k) channels.emplace_back(PackSource::node, k);
      break;
    case MapContent::sectors:
      channels = {{PackSource::height, 0}, {PackSource::ratio, 0}};  // a ratio's place: what turns the layer's sector
      if (has_opposite_ratios(source.parameters))
        channels.insert(channels.end(), {{PackSource::ratio, kOpposite}, {PackSource::ratio, -1}});
      break;
    default:
      if (source.map.is_solid) channels.emplace_back(PackSource::floor, 0);
  }
  return channels;
}

/// Those that are left are ratios.
BakePack pack_of(const TextureImage& image, std::vector<PackChannel> channels, const MapSource& source,
                 const ValueLayout& layout) {
  const auto places = static_cast<std::size_t>(image.layout.channels);
  for (int k = 0; channels.size() < places; ++k)
    channels.emplace_back(PackSource::ratio, k < source.map.ratios ? k : -1);
  BakePack pack{.relief_depth = source.relief_depth,
                .channels = image.layout.channels,
                .texels = texels_of(image),
                .texel_stride = layout.texel_stride,
                .ratio_stride = layout.ratio_stride,
                .is_solid = source.map.is_solid ? 1 : 0};
  for (std::size_t i = 0; i < places; ++i) {
    pack.sources.at(i) = static_cast<std::int32_t>(channels[i].first);
    pack.places.at(i) = channels[i].second;
  }
  return pack;
}

}  // namespace

PackPlan pack_plan(const MapSource& source, const Format& format, const MapTextures& blank, const ValueLayout& layout) {
  PackPlan plan{.textures = {pack_of(blank.relief, relief_channels(source, format), source, layout)}};
  plan.words = words_of(plan.textures.front(), blank.relief);
  if (blank.extra) {
    BakePack& extra = plan.textures.emplace_back(pack_of(*blank.extra, extra_channels(source), source, layout));
    extra.first_word = plan.words;
    extra.is_of_cells = source.map.is_of_cells ? 1 : 0;
    if (source.map.content == MapContent::sectors) {
      const int count = sector_count(source.parameters);
      extra.layers = {SectorAtlas(count, source.heights.width, source.heights.height).columns, count};
    }
    plan.words += words_of(extra, *blank.extra);
  }
  for (BakePack& pack : plan.textures) pack.flag_word = plan.words;
  ++plan.words;
  return plan;
}

int pack_invocations(const BakePack& pack) { return (pack.texels + kTexelsTogether - 1) / kTexelsTogether; }

void fill_textures(MapTextures& textures, const PackPlan& plan, const std::vector<std::byte>& bytes) {
  const auto fill = [&](TextureImage& image, const BakePack& pack) {
    const std::size_t first = sizeof(std::uint32_t) * static_cast<std::size_t>(pack.first_word);
    std::memcpy(image.texels.data(), bytes.data() + first, image.texels.size());
  };
  fill(textures.relief, plan.textures.front());
  if (textures.extra) fill(*textures.extra, plan.textures.back());
}

bool was_cut_short(const PackPlan& plan, const std::vector<std::byte>& bytes) {
  std::uint32_t flag = 0;
  std::memcpy(&flag, bytes.data() + sizeof flag * static_cast<std::size_t>(plan.words - 1), sizeof flag);
  return flag != 0;
}

std::string pack_contract(const BakePacking& packing) {
  const TexelType type = packing.format.type;
  const Encoding& encoding = packing.encoding;
  std::string text;
  const auto add = [&](std::string_view name, const auto& value) {
    text += fmt::format("#define {} {}\n", name, value);
  };
  add("SOURCE_HEIGHT", static_cast<int>(PackSource::height));
  add("SOURCE_FLOOR", static_cast<int>(PackSource::floor));
  add("SOURCE_NODE", static_cast<int>(PackSource::node));
  add("SOURCE_RATIO", static_cast<int>(PackSource::ratio));
  add("SOURCE_NORMAL", static_cast<int>(PackSource::normal));
  add("TEXELS_TOGETHER", kTexelsTogether);
  add("CLEAR_FLAG", kClearFlag);
  add("CODE_BITS", bits_of_code(type));
  if (is_float(type)) add("HAS_FLOATS", 1);
  if (!is_float(type)) add("GREATEST_CODE", fmt::format("{}u", greatest_code(type)));
  if (packing.format.with_normal) add("HAS_NORMALS", 1);
  for (const Encoding& one : encodings()) add(fmt::format("ENCODED_{}", one.id), one.shader_value);
  add("ENCODED", encoding.shader_value);
  if (encoding.is_decreasing) add("IS_DECREASING", 1);
  add("CODES", fmt::format("{}u", code_count(type, encoding)));
  add("DECODING_GUARD", fmt::format("{:.9g}", encoding.guard));
  add("LEAST_DEPTH", fmt::format("{:.9g}", kLeastDepth));
  add("LEAST_TANGENT", fmt::format("{:.9g}", 1.0F / kUnboundedRatio));
  return text;
}

}  // namespace reliefbench
