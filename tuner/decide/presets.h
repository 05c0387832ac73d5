#pragma once
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tuner/plan/config.h"
#include "tuner/plan/preset_file.h"
#include "tuner/results/store.h"

namespace reliefbench {

inline constexpr int kPresetStep = 10;  ///< levels are 0, 10, ..., 100

/// What presets are to be made by. Where nothing is said: as the runs' configs have it, which must then agree.
struct PresetQuery {
  std::optional<std::string> error_metric{};
  std::optional<std::vector<Budget>> constraints{};
};

/// One measurement behind a level. Pointers go into the runs that were asked.
struct PresetEvidence {
  const Run* run = nullptr;
  const Record* record = nullptr;  ///< its scene, case id, frame time
  double error = 0;
};

struct PresetLevel {
  int quality = 0;                       ///< 0 = cheapest, 100 = most accurate
  double relative_time = 1;              ///< median to the scene's fastest; of the worst scene
  double error = 0;                      ///< of the worst scene
  std::vector<PresetEvidence> evidence;  ///< one a scene, by scene; all of the same settings
};

/// The fastest setting of a scene among those that count.
struct SceneFloor {
  std::string scene;
  const Record* fastest = nullptr;
};

/// The levels of one device.
///
/// Only settings count that were measured in every scene and meet the constraints in each. A setting's error and its
/// time relative to the scene's fastest are those of its worst scene; the settings that no other beats in both are the
/// front. Level 0 is its cheapest setting, level 100 its most accurate one, and level q the most accurate whose time is
/// within
///   exp((1 - q/100) log(time of 0) + q/100 log(time of 100)):
/// equal steps of quality cost equal ratios of time. So along the levels error never rises and time never falls;
/// neighbours may share a setting.
struct DevicePresets {
  std::string backend;
  std::string device;
  std::string driver;
  std::vector<SceneFloor> scenes;
  int measured = 0;  ///< settings, in any scene
  int shared = 0;    ///< of them measured in every scene
  int feasible = 0;  ///< of those within the constraints in every scene
  int on_front = 0;
  std::vector<PresetLevel> levels;
};

struct Presets {
  std::string error_metric;
  std::vector<Budget> constraints;
  std::vector<const Run*> runs;
  std::vector<DevicePresets> devices;  ///< by backend and device
};

/// Of two measurements of one setting in one scene, that of the later run in `runs` counts.
/// throws: Error(bad_input): runs that differ in metric, constraints, a device's driver or what a scene is; no setting
///         that all scenes of a device share; Error(answer_is_no): none meets the constraints in all of them;
///         Error(nothing_measured)
[[nodiscard]] Presets make_presets(std::span<const Run> runs, const PresetQuery& query);

[[nodiscard]] nlohmann::json presets_json(const Presets& presets);  ///< presets.json

/// The levels as `#define`s alone, the same text for C++ and GLSL:
///   #if RELIEF_VULKAN_LLVMPIPE_Q50_TECHNIQUE == RELIEF_TECHNIQUE_CONE ... RELIEF_VULKAN_LLVMPIPE_Q50_CONE_STEPS
[[nodiscard]] std::string presets_header(const Presets& presets);

}  // namespace reliefbench
