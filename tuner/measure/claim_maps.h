#pragma once
#include <map>
#include <string>

#include "tuner/measure/bake.h"
#include "tuner/measure/session.h"
#include "tuner/plan/claims_config.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {

/// A row's map, and why its bake has no time that says something of the device, "".
struct MapOfRow {
  BakedMap map{};
  std::string untimed{};
};

[[nodiscard]] bool asks_for_bakes(const Claim& claim);

/// The maps of a claim's rows in one scene, each baked once: where its times count, by hardware itself, and for a
/// software rasteriser on one thread of the processor.
class ClaimMaps {
 public:
  ClaimMaps(const Claim& claim, const SceneSpec& scene, const Heightfield& heights, Session& session);

  [[nodiscard]] const MapOfRow& map_of(const Settings& settings);

 private:
  const SceneSpec& scene_;
  const Heightfield& heights_;
  Session& session_;
  bool on_device_;
  bool on_one_thread_;
  std::map<std::string, MapOfRow> maps_;
};

}  // namespace reliefbench
