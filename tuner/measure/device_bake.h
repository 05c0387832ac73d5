#pragma once
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "tuner/measure/bake.h"
#include "tuner/measure/map_library.h"
#include "tuner/measure/session.h"
#include "tuner/measure/wall_split.h"
#include "tuner/results/record.h"

namespace reliefbench {

/// The median of kHardwareBakes by the device's own baker, from heights to textures where the device packs them, to
/// values where only the processor does. On the device's audited clock, without upload and read-back; on the host's
/// where the device has none that is believed.
/// returns: values: none where the device packed them
/// throws: Error: as GpuBaker
[[nodiscard]] BakedValues bake_on_device(Session& session, const MapStorage& storage, const BakeRequest& request);

/// Whose maps are baked by their device, too, to be timed.
enum class DeviceBakes { hardware, always, never };
[[nodiscard]] bool wants_bakes(DeviceBakes wanted, const DeviceInfo& device);
/// Whether a GPU can make the textures that these settings read: the kind has a baker, and they are not of blocks.
[[nodiscard]] bool has_device_bake(const Settings& settings);

/// What maps take on a session's device, each measured once a run. Must not outlive session, library and split.
class DeviceBakeTimes {
 public:
  /// earlier: of the run
  DeviceBakeTimes(Session& session, MapLibrary& library, WallSplit& split, std::span<const Record> earlier);

  /// ns; none where there is no such bake, or the device did not make it, textures and all. Not to be asked for in a
  /// timing block. record: whose bake_key is the map's tries: measures it where it is not known; else none release:
  /// gives up whatever is on the device; called before it is opened again throws: FileError; Error(environment): the
  /// lost device does not come back
  [[nodiscard]] std::optional<double> time_of(const Record& record, const Settings& settings, const SceneSpec& scene,
                                              bool tries, const std::function<void()>& release);

 private:
  [[nodiscard]] std::optional<double> measure(const Settings& settings, const SceneSpec& scene,
                                              const std::function<void()>& release);

  Session& session_;
  MapLibrary& library_;
  WallSplit& split_;
  std::map<std::string, std::optional<double>> known_;  ///< by bake and storage
};

}  // namespace reliefbench
