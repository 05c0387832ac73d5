#pragma once
#include <string>

#include "kernels/maps/map_kind.h"
#include "kernels/maps/texel.h"

namespace reliefbench {

/// How a map is baked and stored.
struct MapStorage {
  const MapRow& map;
  const Format& format;
  const Encoding& encoding;
  Correction correction = Correction::none;
  float max_ratio = 1;
};

/// Why these do not go together, or "" if they do: a format without room for the map's ratios, or with room for more; a
/// correction that the kind does not have; a ratio or correction that the encoding cannot hold.
[[nodiscard]] std::string conflict(const MapStorage& storage);

}  // namespace reliefbench
