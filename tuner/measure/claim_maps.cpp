#include "tuner/measure/claim_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "kernels/base/error.h"
#include "tuner/measure/repeated_bake.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

/// On the device's clock, without the ways there and back; on the host's where the device has none that is believed.
double device_time_ns(const BakeTime& time, bool is_believed) {
  if (time.parts.empty() || !is_believed) return time.wall_ns;
  double sum_ns = 0;
  for (const ComputeTime& one : time.parts)
    if (one.part != "upload" && one.part != "read_back") sum_ns += one.ns;
  return sum_ns;
}

/// The median of several bakes' times, from heights to textures where the device packs them.
BakedValues timed_on_device(Session& session, const MapStorage& storage, const BakeRequest& request) {
  const Dialect dialect = find_backend(session.device().backend).dialect;
  const GpuBaker packs(session.backend(), dialect, storage.map.kind,
                       BakePacking{.format = storage.format, .encoding = storage.encoding});
  const RepeatedBake made = bake_repeatedly([&] { return packs.bake(request); }, kHardwareBakes, true);
  const TimerAudit* clock = find_part_clock(session.audit());
  std::vector<double> times_ns(made.times.size());
  std::ranges::transform(made.times, times_ns.begin(),
                         [is_believed = clock == nullptr || clock->valid](const BakeTime& time) {
                           return device_time_ns(time, is_believed);
                         });
  return {.time_ns = median(times_ns),
          .values = made.textures ? GpuBaker(session.backend(), dialect, storage.map.kind).bake(request).values
                                  : made.values};
}

/// By the device's own baker; where it has none for the kind, by the CPU's, whose time says nothing of the device.
/// untimed: gets why
BakedValues bake_on_device(Session& session, const MapStorage& storage, const BakeRequest& request,
                           const std::string& key, std::string& untimed) {
  const MapRow& map = storage.map;
  if (!has_gpu_baker(map.kind)) {
    untimed = fmt::format("no GPU baker for {}", map.id);
    return bake_on_cpu(map, request, key);
  }
  try {
    return timed_on_device(session, storage, request);
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
    return on_device_ ? bake_on_device(session_, spec.storage, request, bake_key, made.untimed)
                      : bake_on_cpu(map, request, bake_key);
  });
  return maps_.emplace(key, std::move(made)).first->second;
}

}  // namespace reliefbench
