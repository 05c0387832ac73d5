#include "tuner/measure/map_library.h"

#include <fmt/format.h>

#include <chrono>
#include <cstring>

#include "kernels/base/sha256.h"

namespace reliefbench {
namespace {

std::string heightmap_key(const HeightmapSpec& spec) {
  return fmt::format("{}|{}|{}|{}|{}x{}|{}", spec.source, spec.channel, spec.invert, spec.normalise, spec.width,
                     spec.height, spec.seed);
}

// A cached bake: the time it took, then the values.
std::vector<std::byte> packed(const BakedMap& map) {
  std::vector<std::byte> bytes(sizeof(double) + map.values.size() * sizeof(float));
  std::memcpy(bytes.data(), &map.bake_time_ns, sizeof(double));
  std::memcpy(bytes.data() + sizeof(double), map.values.data(), map.values.size() * sizeof(float));
  return bytes;
}

bool unpack(const std::vector<std::byte>& bytes, BakedMap& map) {
  if (bytes.size() <= sizeof(double)) return false;
  map.values.resize((bytes.size() - sizeof(double)) / sizeof(float));
  std::memcpy(&map.bake_time_ns, bytes.data(), sizeof(double));
  std::memcpy(map.values.data(), bytes.data() + sizeof(double), map.values.size() * sizeof(float));
  return true;
}

}  // namespace

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

const Heightfield& MapLibrary::heights(const SceneSpec& scene) {
  const std::string key = heightmap_key(scene.heightmap);
  auto found = heightmaps_.find(key);
  if (found == heightmaps_.end()) found = heightmaps_.emplace(key, load_heightmap(scene.heightmap)).first;
  return found->second;
}

const BakedMap& MapLibrary::map(const Case& c, const SceneSpec& scene) {
  const std::string text = bake_text(c.settings, scene);
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
    map.key = sha256(fmt::format("bake|{}|{}|{}|{}|{}|{}|{}x{}|{}", row.id, row.version,
                                 correction_id(request.correction), request.max_ratio, parameters_text(request, row),
                                 static_cast<int>(request.wrap), map.heights.width, map.heights.height,
                                 sha256(std::as_bytes(std::span(map.heights.texels)))));
    if (row.content == MapContent::heights) return map;  // nothing to bake
    if (const auto bytes = cache_.get(map.key); bytes && unpack(*bytes, map)) {
      ++from_cache_;
      return map;
    }
    const auto start = std::chrono::steady_clock::now();
    map.values = row.bake(request);
    map.bake_time_ns = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
    ++baked_;
    cache_.put(map.key, packed(map));
    return map;
  });
}

}  // namespace reliefbench
