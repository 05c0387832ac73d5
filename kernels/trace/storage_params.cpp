#include "kernels/trace/storage_params.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/suggest.h"

namespace reliefbench {
namespace {

Param baked(Param param, std::string_view active_if = {}) {
  param.stage = Stage::bake;
  param.active_if = active_if;
  return param;
}

/// The corrections that any of the maps has; conflict() refuses the others.
std::vector<std::string_view> corrections_of(const std::vector<const MapRow*>& maps) {
  std::vector<std::string_view> ids;
  for (const Correction value : corrections())
    if (std::ranges::any_of(maps, [&](const MapRow* map) {
          return std::ranges::find(map->corrections, value) != map->corrections.end();
        }))
      ids.push_back(correction_id(value));
  return ids;
}

}  // namespace

Param map_param(const MapParam& param) {
  return {.id = param.id,
          .description = param.description,
          .stage = Stage::bake,
          .min = param.min,
          .max = param.max,
          .fallback = param.fallback,
          .choices = {param.choices.begin(), param.choices.end()},
          .is_constant = param.is_constant,
          .is_spelt_out = param.is_spelt_out};
}

std::vector<Param> storage_params(const std::vector<MapKind>& kinds, const StorageUse& use) {
  std::vector<const MapRow*> maps;  // that a bake makes
  for (const MapKind kind : kinds)
    if (const MapRow& map = find_map(kind); map.content != MapContent::heights) maps.push_back(&map);
  std::vector<Param> params;

  const bool is_choice = maps.size() > 1;
  if (is_choice) {
    std::vector<std::string_view> ids;
    ids.reserve(maps.size());
    for (const MapRow* map : maps) ids.push_back(map->id);
    params.push_back(baked(choice_param("map", "which map is baked", ids, ids.front()), use.active_if));
  }
  for (const MapRow* map : maps)
    for (const MapParam& own : map->parameters)
      params.push_back(baked(map_param(own), is_choice ? fmt::format("map={}", map->id) : std::string(use.active_if)));

  if (const std::vector<std::string_view> ids = corrections_of(maps); ids.size() > 1)
    params.push_back(
        baked(choice_param("correction", "what makes interpolated cones safe", ids, use.correction), use.active_if));
  const bool has_ratios = std::ranges::any_of(maps, [](const MapRow* map) { return map->ratios > 0; });
  if (has_ratios && use.has_max_ratio)
    params.push_back(baked(choice_param("max_ratio", "widest cone that is baked; beyond 1 for floats and h_tan only",
                                        {"1", "unbounded"}, "1"),
                           use.active_if));
  // Of the bake: cones are built from the heights as the format rounds them.
  params.push_back(baked(choice_param("format", "texture format of the relief map", ids_of(formats()), use.format)));
  if (has_ratios) {
    Param encoding = choice_param("encoding", "how the cone ratio is stored", ids_of(encodings()), "sqrt");
    encoding.active_if = use.active_if;
    encoding.constant_id = kEncodingConstant;
    params.push_back(std::move(encoding));
  }
  return params;
}

}  // namespace reliefbench
