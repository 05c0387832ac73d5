#pragma once
#include <list>
#include <span>
#include <string>
#include <vector>

#include "kernels/maps/map_texture.h"
#include "tuner/measure/cache.h"
#include "tuner/measure/wall_split.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {

/// A baked map: heights as the texture's format rounds them, and what its baker made of those.
struct BakedMap {
  Heightfield heights{};
  std::vector<float> values{};  ///< as MapRow::content says; empty for a height map
  double bake_time_ns = 0;      ///< when it was baked; kept through the cache
  std::string key{};            ///< bake_key()
};

/// The bake that settings ask for. heights: as the settings' format rounds them; must outlive the request
[[nodiscard]] BakeRequest bake_request(const Settings& settings, const Heightfield& heights, Wrap wrap);
/// What identifies a bake: its kind with the baker's version, the heights as they are stored, its parameters.
[[nodiscard]] std::string bake_key(const MapRow& map, const BakeRequest& request);
/// A baked map in the settings' format and encoding. relief_depth: of the scene
[[nodiscard]] MapTextures map_textures(const Settings& settings, const BakedMap& map, Wrap wrap, double relief_depth);

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
  /// The map of a case that has a `format`; valid until another kRecentMaps maps were asked for.
  [[nodiscard]] const BakedMap& map(const Case& c, const SceneSpec& scene);

  [[nodiscard]] int baked() const { return baked_; }
  [[nodiscard]] int from_cache() const { return from_cache_; }

 private:
  static constexpr std::size_t kRecentMaps = 4;
  [[nodiscard]] BakedMap load_or_bake(const Case& c, const SceneSpec& scene);

  const Cache& cache_;
  WallSplit& split_;
  Heightmaps heightmaps_;
  std::list<std::pair<std::string, BakedMap>> recent_;  // by heights and bake_text(), latest first
  int baked_ = 0;
  int from_cache_ = 0;
};

}  // namespace reliefbench
