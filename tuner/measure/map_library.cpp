#include "tuner/measure/map_library.h"

#include <fmt/format.h>

#include <chrono>

#include "tuner/measure/cached_values.h"
#include "tuner/results/stages.h"

namespace reliefbench {
BakeRequest bake_request(const Settings& settings, const Heightfield& heights, Wrap wrap) {
  const auto is_on = [&](std::string_view id) {
    const Param* const param = settings.technique().find(id);
    return param != nullptr && settings.is_active(*param);
  };
  const MapStorage storage = storage_of(settings);
  BakeRequest request{
      .heights = heights, .wrap = wrap, .correction = storage.correction, .max_ratio = storage.max_ratio};
  if (is_on("search_steps")) request.search_steps = settings.get("search_steps");
  if (is_on("distance_slices")) request.distance_slices = settings.get("distance_slices");
  return request;
}

MapTextures map_textures(const Settings& settings, const BakedMap& map, Wrap wrap, double relief_depth) {
  const MapStorage storage = storage_of(settings);
  const bool has_levels = settings.technique().find("lod") != nullptr && settings.choice("lod") == "footprint";
  return pack_map({.map = storage.map,
                   .heights = map.heights,
                   .values = map.values,
                   .wrap = wrap,
                   .relief_depth = relief_depth,
                   .mips = has_levels},
                  storage.format, storage.encoding);
}

std::string bake_key(const MapRow& map, const BakeRequest& request) {
  return stage_key({bake_stage(map.id)},
                   {heights_sha256(request.heights), request.wrap == Wrap::repeat ? "repeat" : "clamp",
                    correction_id(request.correction), fmt::format("{}", request.max_ratio),
                    fmt::format("{}", request.search_steps), fmt::format("{}", request.distance_slices)});
}

std::vector<MeasuredScene> MapLibrary::measured(std::span<const SceneSpec> scenes) {
  std::vector<MeasuredScene> list;
  for (const SceneSpec& scene : scenes) list.push_back(measured_scene(scene, loaded(scene)));
  return list;
}

const BakedMap& MapLibrary::map(const Case& c, const SceneSpec& scene) {
  const std::string text = loaded(scene).sha256 + bake_text(c.settings, scene);
  for (auto it = recent_.begin(); it != recent_.end(); ++it) {
    if (it->first != text) continue;
    recent_.splice(recent_.begin(), recent_, it);
    return it->second;
  }
  recent_.emplace_front(text, load_or_bake(c, scene));
  if (recent_.size() > kRecentMaps) recent_.pop_back();
  return recent_.front().second;
}

BakedMap MapLibrary::load_or_bake(const Case& c, const SceneSpec& scene) {
  const Heightfield& source = heights(scene);
  const MapRow& row = map_of(c.settings);
  return split_.book(Part::bake, [&] {
    const TexelType type = find_format(c.settings.choice("format")).type;
    BakedMap map{.heights = quantise_heights(source, type)};
    const BakeRequest request = bake_request(c.settings, map.heights, scene.scene.wrap);
    map.key = bake_key(row, request);
    if (row.content == MapContent::heights) return map;  // nothing to bake
    if (const auto bytes = cache_.get(map.key)) {
      if (std::optional<CachedBake> bake = read_bake(*bytes, baked_value_count(row, request))) {
        map.bake_time_ns = bake->time_ns;
        map.values = std::move(bake->values);
        ++from_cache_;
        return map;
      }
    }
    const auto start = std::chrono::steady_clock::now();
    map.values = row.bake(request);
    map.bake_time_ns = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
    ++baked_;
    cache_.put(map.key, bake_bytes(map.bake_time_ns, map.values));
    return map;
  });
}

}  // namespace reliefbench
