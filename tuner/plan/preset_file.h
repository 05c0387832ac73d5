#pragma once
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/trace/technique.h"

namespace reliefbench {

inline constexpr int kPresetsSchema = 1;

/// One level as read back.
struct LoadedPreset {
  std::string backend;
  std::string device;
  int quality = 0;
  Settings settings;
  /// backend, device, quality; as far as the file says driver, error_metric, relative_time, error; scenes: a list of
  /// {scene, case, time_ns, ci, samples, error}.
  nlohmann::json evidence{};
};
/// throws: Error(bad_input) "FILE:LINE: key 'a.b': ...": not presets, another schema, unknown techniques, parameters or
///         values
[[nodiscard]] std::vector<LoadedPreset> parse_presets(std::string_view text, std::string_view file);

/// Which level is meant. Empty texts: any.
struct PresetChoice {
  int quality = 0;
  std::string backend{};
  std::string device{};  ///< glob on the device's name
};
/// throws: Error(bad_input) naming what there is: no such level or device, several devices that fit
[[nodiscard]] const LoadedPreset& choose_preset(std::span<const LoadedPreset> presets, const PresetChoice& choice,
                                                std::string_view file);

}  // namespace reliefbench
