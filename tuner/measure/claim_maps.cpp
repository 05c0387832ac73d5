#include "tuner/measure/claim_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "backends/gpu_bake.h"
#include "kernels/base/error.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr int kBakes = 5;  // whose median is a device's bake_time, after one that counts for nothing

bool asks_for_bakes(const Claim& claim) {
  return std::ranges::find(claim.metrics, "bake_time") != claim.metrics.end() ||
         std::ranges::find(claim.checks, "bake_time", &ClaimCheck::metric) != claim.checks.end();
}

/// Of a bake on the device's clock, without the ways there and back; on the host's where the device has none.
double device_time_ns(const GpuBake& bake, double wall_ns) {
  if (bake.times.empty()) return wall_ns - bake.transport_ns;
  double sum_ns = 0;
  for (const ComputeTime& time : bake.times)
    if (time.part != "upload" && time.part != "read_back") sum_ns += time.ns;
  return sum_ns;
}

/// The median of several bakes, after one that warms the device up.
BakedValues timed_on_device(const GpuBaker& baker, const BakeRequest& request) {
  BakedValues baked{.values = baker.bake(request).values};
  std::vector<double> times_ns(kBakes);
  for (double& time_ns : times_ns) {
    GpuBake bake;
    const BakedValues timed = timed_bake([&] {
      bake = baker.bake(request);
      return std::vector<float>();
    });
    time_ns = device_time_ns(bake, timed.time_ns);
  }
  baked.time_ns = median(times_ns);
  return baked;
}

/// By the device's own baker; where it has none for the kind, by the CPU's, whose time says nothing of the device.
/// untimed: gets why
BakedValues bake_on_device(Session& session, const MapRow& map, const BakeRequest& request, const std::string& key,
                           std::string& untimed) {
  if (std::ranges::find(gpu_bakers(), map.kind) == gpu_bakers().end()) {
    untimed = fmt::format("no GPU baker for {}", map.id);
    return bake_on_cpu(map, request, key);
  }
  try {
    const Dialect dialect = find_backend(session.device().backend).dialect;
    return timed_on_device(GpuBaker(session.backend(), dialect, map.kind), request);
  } catch (const DeviceGone&) {
    throw;
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
