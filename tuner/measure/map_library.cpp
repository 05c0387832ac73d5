#include "tuner/measure/map_library.h"

#include "tuner/measure/cached_values.h"

namespace reliefbench {

std::vector<MeasuredScene> MapLibrary::measured(std::span<const SceneSpec> scenes) {
  std::vector<MeasuredScene> list;
  list.reserve(scenes.size());
  for (const SceneSpec& scene : scenes) list.push_back(measured_scene(scene, loaded(scene)));
  return list;
}

const BakedMap& MapLibrary::map(const Settings& settings, const SceneSpec& scene) {
  const LoadedHeights& heights = loaded(scene);
  const Baker baker = [this](const MapRow& map, const BakeRequest& request, const std::string& key) {
    return bake_or_read(map, request, key);
  };
  return recent_.get(heights.sha256 + bake_text(settings, scene), [&] {
    return split_.book(Part::bake, [&] { return bake(bake_spec(settings, scene.scene.wrap), heights.field, baker); });
  });
}

std::optional<MapTextures> MapLibrary::packed(const Settings& settings, const SceneSpec& scene) {
  if (!settings.technique().reads_map()) return std::nullopt;
  return pack(settings, map(settings, scene), scene.scene);
}

BakedValues MapLibrary::bake_or_read(const MapRow& map, const BakeRequest& request, const std::string& key) {
  Made<BakedValues> made =
      cached(cache_, key, bake_codec(baked_value_count(map, request)), [&] { return bake_on_cpu(map, request, key); });
  ++(made.is_new ? baked_ : from_cache_);
  return std::move(made.value);
}

}  // namespace reliefbench
