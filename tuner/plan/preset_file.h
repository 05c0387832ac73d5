#pragma once
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/trace/technique.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {

inline constexpr int kPresetsSchema = 2;
inline constexpr int kBestPreset = 100;  ///< quality goes from 0 to this

/// One level as read back.
struct LoadedPreset {
  std::string backend;
  std::string device;
  int quality = 0;
  Settings settings;
  /// backend, device, quality; as far as the file says driver, error_metric, relative_time, error; scenes: a list of
  /// {scene, scene_key, case, time_ns, ci, samples, error}.
  nlohmann::json evidence{};
  std::vector<MeasuredScene> scenes{};  ///< parallel to evidence's scenes
};
/// throws: Error(bad_input) "FILE:LINE: key 'a.b': ...": not presets, another schema, unknown techniques, parameters or
///         values
[[nodiscard]] std::vector<LoadedPreset> parse_presets(std::string_view text, std::string_view file);

/// Which level is meant: the best that is no higher than `quality`. Empty texts: any.
struct PresetChoice {
  int quality = 0;  ///< 0 to kBestPreset
  std::string backend{};
  std::string device{};  ///< glob on the device's name
};
/// throws: Error(bad_input) naming what there is: no such device, several that fit, a quality out of range
[[nodiscard]] const LoadedPreset& choose_preset(std::span<const LoadedPreset> presets, const PresetChoice& choice,
                                                std::string_view file);

}  // namespace reliefbench
