#include "tuner/measure/map_library.h"

#include <fmt/format.h>

#include <chrono>

#include "tuner/measure/cached_values.h"
#include "tuner/results/stages.h"

namespace reliefbench {
BakeRequest bake_request(const Settings& settings, const Heightfield& heights, Wrap wrap) {
  const MapStorage storage = storage_of(settings);
  return {.heights = heights,
          .wrap = wrap,
          .correction = storage.correction,
          .max_ratio = storage.max_ratio,
          .parameters = map_values(settings)};
}

MapTextures map_textures(const Settings& settings, const BakedMap& map, Wrap wrap, double relief_depth) {
  const MapStorage storage = storage_of(settings);
  return pack_map({.map = storage.map,
                   .heights = map.heights,
                   .values = map.values,
                   .wrap = wrap,
                   .relief_depth = relief_depth,
                   .mips = reads_levels(settings)},
                  storage.format, storage.encoding);
}

std::string bake_key(const MapRow& map, const BakeRequest& request) {
  return stage_key(
      {bake_stage(map.id)},
      {heights_sha256(request.heights), request.wrap == Wrap::repeat ? "repeat" : "clamp",
       correction_id(request.correction), fmt::format("{}", request.max_ratio), parameters_text(request, map)});
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
    BakedMap map{.heights = quantise_heights(source, storage_of(c.settings).format.type)};
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
