#include "tuner/measure/claim_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "backends/gpu_bake.h"
#include "kernels/base/error.h"
#include "tuner/measure/device_bake.h"

namespace reliefbench {
namespace {

/// Its values too, which a device that packs does not give.
BakedValues baked_and_timed(Session& session, const MapStorage& storage, const BakeRequest& request) {
  BakedValues made = bake_on_device(session, storage, request);
  if (made.values.empty())
    made.values = GpuBaker(session.backend(), find_backend(session.device().backend).dialect, storage.map.kind)
                      .bake(request)
                      .values;
  return made;
}

/// By the device's own baker; where it has none for the kind, by the CPU's, whose time says nothing of the device.
/// untimed: gets why
BakedValues bake_where_it_can(Session& session, const MapStorage& storage, const BakeRequest& request,
                              const std::string& key, std::string& untimed) {
  const MapRow& map = storage.map;
  if (!has_gpu_baker(map.kind)) {
    untimed = fmt::format("no GPU baker for {}", map.id);
    return bake_on_cpu(map, request, key);
  }
  try {
    return baked_and_timed(session, storage, request);
  } catch (const Error& error) {
    if (error.code() != Exit::environment || error.fault() != Fault::other) throw;
    untimed = error.what();
  }
  return bake_on_cpu(map, request, key);
}

}  // namespace

bool asks_for_bakes(const Claim& claim) { return claim.asks_for("bake_time"); }

ClaimMaps::ClaimMaps(const Claim& claim, const SceneSpec& scene, const Heightfield& heights, Session& session)
    : scene_(scene),
      heights_(heights),
      session_(session),
      on_device_(!session.device().software && !claim.is_contest() && asks_for_bakes(claim)),
      on_one_thread_(session.device().software && !claim.is_contest()) {}

const MapOfRow& ClaimMaps::map_of(const Settings& settings) {
  const std::string key = bake_text(settings, scene_);
  const auto found = maps_.find(key);
  if (found != maps_.end()) return found->second;
  MapOfRow made;
  if (!on_device_ && !on_one_thread_) made.untimed = "bakes are not timed";
  BakeSpec spec = bake_spec(settings, scene_.scene.wrap);
  spec.threads = on_one_thread_ ? 1 : 0;
  made.map = bake(spec, heights_, [&](const MapRow& map, const BakeRequest& request, const std::string& bake_key) {
    return on_device_ ? bake_where_it_can(session_, spec.storage, request, bake_key, made.untimed)
                      : bake_on_cpu(map, request, bake_key);
  });
  return maps_.emplace(key, std::move(made)).first->second;
}

}  // namespace reliefbench
