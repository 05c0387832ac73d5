#include "kernels/maps/map_storage.h"

#include <fmt/format.h>

#include <algorithm>

namespace reliefbench {
namespace {

/// Floors come before ratios.
std::string solid_format_conflict(const MapRow& map, const Format& format) {
  if (format.with_normal || format.ratios() < values_beside(map))
    return fmt::format("format {} has no room for the {} that a {} map keeps beside its heights", format.id,
                       map.ratios > 0 ? "floor and cones" : "floor", map.id);
  if (format.ratios() > values_beside(map) + 1)
    return fmt::format("format {} has 4 values beside the height, a {} map fills {}", format.id, map.id,
                       values_beside(map));
  if (map.content == MapContent::pyramid && format.extra_channels > 0)
    return fmt::format("format {} has a texture for floors, where a {} map has its pyramid", format.id, map.id);
  return "";
}

std::string format_conflict(const MapRow& map, const Format& format) {
  if (is_of_blocks(format.type) &&
      (map.is_solid || (map.content != MapContent::heights && map.content != MapContent::ratios)))
    return fmt::format("format {} is of blocks, in which a {} map is not kept", format.id, map.id);
  if (map.is_solid) return solid_format_conflict(map, format);
  if (format.ratios() < map.ratios)
    return fmt::format("format {} has room for {} cone ratios, a {} map needs {}", format.id, format.ratios(), map.id,
                       map.ratios);
  if (map.content != MapContent::ratios && format.extra_channels > 0)
    return fmt::format("format {} has a texture for ratios, which a {} map does not fill", format.id, map.id);
  if (map.ratios == 1 && format.extra_channels > 1)
    return fmt::format("format {} has 4 cone ratios, a {} map fills one", format.id, map.id);
  if (map.content == MapContent::sectors) {
    if (format.channels == 2) return "";
    return fmt::format("format {} is not of two channels, height and ratio, as a {} map has them", format.id, map.id);
  }
  if (map.content != MapContent::heights && map.content != MapContent::ratios && format.channels > 1)
    return fmt::format("format {} has room for cone ratios, which a {} map does not have", format.id, map.id);
  return "";
}

std::string correction_conflict(const MapStorage& storage) {
  const auto& known = storage.map.corrections;
  if (std::find(known.begin(), known.end(), storage.correction) == known.end())
    return fmt::format("a {} map has no correction {}", storage.map.id, correction_id(storage.correction));
  if (storage.correction == Correction::certified && storage.encoding.is_over_depth)
    return fmt::format("certified cones are proved for interpolated ratios, {} interpolates radii",
                       storage.encoding.id);
  return "";
}

std::string ratio_conflict(const MapStorage& storage) {
  const bool is_unorm = !is_float(storage.format.type);
  const std::string_view encoding = storage.encoding.id;
  if (storage.format.type == TexelType::bc7 && storage.encoding.is_decreasing)
    return fmt::format("{} cannot hold every cone as {}", storage.format.id, encoding);
  if (storage.max_ratio > 1 && storage.map.content == MapContent::sectors)
    return fmt::format("ratios of a {} map are at most 1", storage.map.id);
  if (storage.max_ratio > 1 && is_unorm && encoding != "h_tan" && encoding != "atan")
    return fmt::format("{} cannot hold a ratio over 1 as {}", storage.format.id, encoding);
  return "";
}

}  // namespace

std::string conflict(const MapStorage& storage) {
  if (std::string reason = correction_conflict(storage); !reason.empty()) return reason;
  if (std::string reason = format_conflict(storage.map, storage.format); !reason.empty()) return reason;
  return ratio_conflict(storage);
}

}  // namespace reliefbench
