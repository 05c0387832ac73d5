#pragma once
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "tuner/decide/fleet.h"
#include "tuner/plan/config.h"
#include "tuner/plan/preset_file.h"
#include "tuner/results/coarse_filter.h"
#include "tuner/results/store.h"

namespace reliefbench {

inline constexpr std::string_view kSeenMetric = "flip";  ///< the one that is linear in what is seen

inline constexpr int kPresetStep = 10;  ///< levels are among 0, 10, ..., kBestPreset

/// What presets are to be made by. Where nothing is said: as the runs have it, which must then agree.
struct PresetQuery {
  std::optional<std::string> error_metric{};         ///< also that by which levels are spaced
  std::optional<std::vector<Budget>> constraints{};  ///< of every level; else the front's and the runs' budgets
};

/// One measurement behind a level. Pointers go into the runs that were asked.
struct PresetEvidence {
  const Run* run = nullptr;
  const Record* record = nullptr;  ///< its scene, case id, frame time
  double error = 0;

  /// Of the run's device.
  [[nodiscard]] CoarseFilter filter() const { return {run->info, record->backend}; }
};

struct PresetLevel {
  int quality = 0;                       ///< 0 = cheapest, 100 = most accurate
  double relative_time = 1;              ///< median to the scene's fastest; of the worst scene
  double error = 0;                      ///< of the worst scene
  double level_error = 0;                ///< Presets::level_metric, of the worst scene
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
/// time relative to the scene's fastest are those of its worst scene. Levels are equal steps of the error that is seen,
/// between that of the cheapest setting and the least there is, where less than a fiftieth of the former (.01 texel
/// where .5 is allowed) counts as none: equal differences of FLIP, which is made to be linear in what is seen, and
/// equal ratios of other errors. Of the settings that are as accurate as a level asks, choose() takes one, but none
/// that is slower than the next better level or more accurate: so along the levels error never rises and time never
/// falls. Levels that would be the same setting as the one below are left out: fewer than eleven where the settings are
/// few.
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

/// A level of a fleet, and what it costs in each place beyond that place's own best that is as accurate.
struct CommonLevel {
  int quality = 0;
  double level_error = 0;    ///< of the worst place
  std::vector<Loss> losses;  ///< parallel to the places
  Loss combined;
};
struct CommonPresets {
  Regret regret = Regret::minimax;
  std::vector<FleetPlace> places;
  std::vector<CommonLevel> levels;
};

struct Presets {
  std::string error_metric;
  std::string level_metric;  ///< by which levels are spaced: flip where pictures were compared, else error_metric
  std::vector<Budget> constraints;
  std::vector<const Run*> runs;
  std::vector<DevicePresets> devices;  ///< by backend and device
  std::vector<std::string> warnings;
  std::optional<CommonPresets> common{};  ///< then the devices' levels are all of these settings
};

/// Of two measurements of one setting in one scene, that of the later run in `runs` counts.
/// throws: Error(bad_input): runs that differ in metric, constraints, budgets, a device's driver or, where it is
///         software, processor, or what a scene is; no setting that all scenes of a device share;
///         Error(answer_is_no): none meets the constraints in all of them; Error(nothing_measured)
[[nodiscard]] Presets make_presets(std::span<const Run> runs, const PresetQuery& query);

/// One table of levels for all devices of the runs: a level's setting is choose_for_fleet()'s among those whose error
/// in the worst place is within the level's, but none that is slower anywhere than the next better level or more
/// accurate. Levels are spaced as those of one device, by the error of the fleet's worst place.
/// fleet: the runs as tables, parallel to them; levels point into both
/// throws: as make_presets() and choose_for_fleet(); Error(bad_input): a device with two drivers
[[nodiscard]] Presets make_common_presets(std::span<const Run> runs, std::span<const FleetRun> fleet,
                                          const PresetQuery& query, Regret regret);

/// What presets are made by, without any level: metrics, constraints and runs. throws: Error(bad_input): the runs
/// differ
[[nodiscard]] Presets asked_presets(std::span<const Run> runs, const PresetQuery& query);

/// The largest error that a level allows. loosest: that of the cheapest setting; least: the least there is
[[nodiscard]] double level_limit(double loosest, double least, int quality, const Presets& presets);

/// CoarseFilter::kMark where the error of one of the level's measurements rests on a coarse sampler; or nothing.
[[nodiscard]] std::string_view coarse_mark(const PresetLevel& level);
/// What these marks mean, a line for each device that has any.
[[nodiscard]] std::set<std::string> coarse_notes(const Presets& presets);

[[nodiscard]] nlohmann::json presets_json(const Presets& presets);  ///< presets.json

/// The levels 0, 10, ..., 100 as `#define`s alone, the same text for C++ and GLSL; one that was left out is the one
/// below it:
///   #if RELIEF_VULKAN_LLVMPIPE_Q50_TECHNIQUE == RELIEF_TECHNIQUE_CONE ... RELIEF_VULKAN_LLVMPIPE_Q50_CONE_STEPS
[[nodiscard]] std::string presets_header(const Presets& presets);

}  // namespace reliefbench
