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

bool asks_for_bakes(const Claim& claim) {
  return std::ranges::find(claim.metrics, "bake_time") != claim.metrics.end() ||
         std::ranges::find(claim.checks, "bake_time", &ClaimCheck::metric) != claim.checks.end();
}

/// On the device's clock, without the ways there and back; on the host's where the device has none.
double device_time_ns(const BakeTime& time) {
  if (time.parts.empty()) return time.wall_ns;
  double sum_ns = 0;
  for (const ComputeTime& one : time.parts)
    if (one.part != "upload" && one.part != "read_back") sum_ns += one.ns;
  return sum_ns;
}

/// The median of several bakes' times.
BakedValues timed_on_device(const GpuBaker& baker, const BakeRequest& request) {
  RepeatedBake made = bake_repeatedly([&] { return baker.bake(request); }, kHardwareBakes, true);
  std::vector<double> times_ns(made.times.size());
  std::ranges::transform(made.times, times_ns.begin(), device_time_ns);
  return {.time_ns = median(times_ns), .values = std::move(made.values)};
}

/// By the device's own baker; where it has none for the kind, by the CPU's, whose time says nothing of the device.
/// untimed: gets why
BakedValues bake_on_device(Session& session, const MapRow& map, const BakeRequest& request, const std::string& key,
                           std::string& untimed) {
  if (!has_gpu_baker(map.kind)) {
    untimed = fmt::format("no GPU baker for {}", map.id);
    return bake_on_cpu(map, request, key);
  }
  try {
    const Dialect dialect = find_backend(session.device().backend).dialect;
    return timed_on_device(GpuBaker(session.backend(), dialect, map.kind), request);
  } catch (const Error& error) {
    if (error.code() != Exit::environment || error.fault() != Fault::other) throw;
    untimed = error.what();
  }
  return bake_on_cpu(map, request, key);
}

}  // namespace

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
    return on_device_ ? bake_on_device(session_, map, request, bake_key, made.untimed)
                      : bake_on_cpu(map, request, bake_key);
  });
  return maps_.emplace(key, std::move(made)).first->second;
}

}  // namespace reliefbench
