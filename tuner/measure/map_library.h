#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kernels/base/cache.h"
#include "tuner/measure/frame.h"
#include "tuner/measure/wall_split.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {

/// Heightmaps and baked maps, each made once: in memory while it is in use, on disk for good.
class MapLibrary {
 public:
  /// heightmaps: what has been read already
  MapLibrary(const Cache& cache, WallSplit& split, Heightmaps heightmaps = {})
      : cache_(cache), split_(split), heightmaps_(std::move(heightmaps)) {}

  /// As they are read, once; valid while the library lives.
  [[nodiscard]] const LoadedHeights& loaded(const SceneSpec& scene) { return heightmaps_.read(scene.heightmap); }
  [[nodiscard]] const Heightfield& heights(const SceneSpec& scene) { return loaded(scene).field; }
  /// What was read of which files.
  [[nodiscard]] std::vector<std::string> readings() const { return heightmaps_.readings(); }
  [[nodiscard]] std::vector<MeasuredScene> measured(std::span<const SceneSpec> scenes);
  /// bake(), cached; valid until another kRecentMaps maps were asked for.
  [[nodiscard]] const BakedMap& map(const Settings& settings, const SceneSpec& scene);
  /// pack() of that map. Where the technique reads none, none is baked.
  [[nodiscard]] std::optional<MapTextures> packed(const Settings& settings, const SceneSpec& scene);

  [[nodiscard]] int baked() const { return baked_; }
  [[nodiscard]] int from_cache() const { return from_cache_; }

 private:
  static constexpr std::size_t kRecentMaps = 4;
  [[nodiscard]] BakedValues bake_or_read(const MapRow& map, const BakeRequest& request, const std::string& key);

  const Cache& cache_;
  WallSplit& split_;
  Heightmaps heightmaps_;
  Recent<BakedMap> recent_{kRecentMaps};  // by heights and bake_text()
  int baked_ = 0;
  int from_cache_ = 0;
};

}  // namespace reliefbench
