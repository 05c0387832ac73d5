#pragma once
#include <functional>
#include <string>
#include <vector>

#include "kernels/maps/map_kind.h"
#include "kernels/maps/map_storage.h"
#include "kernels/trace/technique.h"

namespace reliefbench {

/// What is baked of a heightmap.
struct BakeSpec {
  MapStorage storage;
  Wrap wrap = Wrap::repeat;
  std::vector<MapValue> parameters{};  ///< of the map's own
  int threads = 0;                     ///< 0: as many as the machine has
};
[[nodiscard]] BakeSpec bake_spec(const Settings& settings, Wrap wrap);

/// What a baker made of a request.
struct BakedValues {
  double time_ns = 0;           ///< when it was baked, of the bake alone
  std::vector<float> values{};  ///< as MapRow::content says
};
/// Makes the values that a map's heights alone do not hold. key: what identifies them
using Baker = std::function<BakedValues(const MapRow& map, const BakeRequest& request, const std::string& key)>;

/// Runs `make` for the values and takes its time.
[[nodiscard]] BakedValues timed_bake(const std::function<std::vector<float>()>& make);
/// The map kind's own baker, on the CPU.
[[nodiscard]] BakedValues bake_on_cpu(const MapRow& map, const BakeRequest& request, const std::string& key);

/// A baked map: heights as the texture's format rounds them, and what its baker made of those.
struct BakedMap {
  Heightfield heights{};
  std::vector<float> values{};  ///< as MapRow::content says; empty for a height map
  double bake_time_ns = 0;      ///< 0 for a height map
  /// What identifies the bake: kind with the baker's version, heights as they are stored, wrap, parameters.
  std::string key{};
};

/// Heights as read -> map. baker: of all kinds but height maps, which need none
/// throws: Error(bad_input): a request that the kind has no answer to
[[nodiscard]] BakedMap bake(const BakeSpec& spec, const Heightfield& heights, const Baker& baker = bake_on_cpu);

}  // namespace reliefbench
