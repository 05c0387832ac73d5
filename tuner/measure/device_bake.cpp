#include "tuner/measure/device_bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>
#include <vector>

#include "backends/gpu_bake.h"
#include "kernels/base/error.h"
#include "kernels/base/file_error.h"
#include "tuner/measure/repeated_bake.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

/// On the device's clock, without the ways there and back; on the host's where the device has none that is believed.
double part_time_ns(const BakeTime& time, bool is_believed) {
  if (time.parts.empty() || !is_believed) return time.wall_ns;
  double sum_ns = 0;
  for (const ComputeTime& one : time.parts)
    if (one.part != "upload" && one.part != "read_back") sum_ns += one.ns;
  return sum_ns;
}

std::string bake_and_storage(const Record& record, const Settings& settings) {
  const MapStorage storage = storage_of(settings);
  return fmt::format("{} {} {}", record.bake_key, storage.format.id, storage.encoding.id);
}

}  // namespace

BakedValues bake_on_device(Session& session, const MapStorage& storage, const BakeRequest& request) {
  const Dialect dialect = find_backend(session.device().backend).dialect;
  const GpuBaker packs(session.backend(), dialect, storage.map.kind,
                       BakePacking{.format = storage.format, .encoding = storage.encoding});
  RepeatedBake made = bake_repeatedly([&] { return packs.bake(request); }, kHardwareBakes, true);
  const TimerAudit* clock = find_part_clock(session.audit());
  std::vector<double> times_ns(made.times.size());
  std::ranges::transform(made.times, times_ns.begin(),
                         [is_believed = clock == nullptr || clock->valid](const BakeTime& time) {
                           return part_time_ns(time, is_believed);
                         });
  return {.time_ns = median(times_ns), .values = std::move(made.values)};
}

bool wants_bakes(DeviceBakes wanted, const DeviceInfo& device) {
  return wanted == DeviceBakes::always || (wanted == DeviceBakes::hardware && !device.software);
}

bool has_device_bake(const Settings& settings) {
  if (!settings.technique().reads_map()) return false;
  const MapStorage storage = storage_of(settings);
  return has_gpu_baker(storage.map.kind) && !is_of_blocks(storage.format.type);
}

DeviceBakeTimes::DeviceBakeTimes(Session& session, MapLibrary& library, WallSplit& split,
                                 std::span<const Record> earlier)
    : session_(session), library_(library), split_(split) {
  for (const Record& record : earlier)
    if (record.device_bake_ns && record.backend == session.device().backend)
      known_[bake_and_storage(record, settings_of(record.technique, record.params))] = record.device_bake_ns;
}

std::optional<double> DeviceBakeTimes::time_of(const Record& record, const Settings& settings, const SceneSpec& scene,
                                               bool tries, const std::function<void()>& release) {
  if (!has_device_bake(settings)) return std::nullopt;
  const std::string key = bake_and_storage(record, settings);
  const auto found = known_.find(key);
  if (found != known_.end()) return found->second;
  if (!tries) return std::nullopt;
  const auto [made, is_new] = known_.try_emplace(key);  // whatever comes of it, it is not tried again
  made->second = measure(settings, scene, release);
  return made->second;
}

std::optional<double> DeviceBakeTimes::measure(const Settings& settings, const SceneSpec& scene,
                                               const std::function<void()>& release) {
  std::optional<double> time_ns;
  const BakeSpec spec = bake_spec(settings, scene.scene.wrap);
  try {
    static_cast<void>(bake(spec, library_.heights(scene),
                           [&](const MapRow& /*map*/, const BakeRequest& request, const std::string& /*key*/) {
                             BakedValues made = split_.book(
                                 Part::bake, [&] { return bake_on_device(session_, spec.storage, request); });
                             if (made.values.empty()) time_ns = made.time_ns;  // else the processor would pack them
                             return made;
                           }));
  } catch (const FileError&) {
    throw;
  } catch (const Error& error) {
    if (!session_.helps_reopening(error.fault())) return std::nullopt;
    release();
    session_.reopen();
  } catch (const std::bad_alloc&) {
    return std::nullopt;
  }
  return time_ns && std::isfinite(*time_ns) && *time_ns > 0 ? time_ns : std::nullopt;
}

}  // namespace reliefbench
