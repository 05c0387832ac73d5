#pragma once
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "tuner/measure/map_library.h"
#include "tuner/measure/session.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/config.h"
#include "tuner/plan/scene_key.h"
#include "tuner/results/stages.h"

namespace reliefbench {

/// A device of a run as run.json keeps it, with its audit and calibration.
[[nodiscard]] nlohmann::json device_json(const Session& session);
/// The calibration of a device in an earlier start's run.json; nothing where there is none.
[[nodiscard]] std::optional<Calibration> known_calibration(const nlohmann::json& info, const DeviceInfo& device);

/// What a run's maps and wall time were.
void set_costs(SweepSummary& summary, const MapLibrary& library, const WallSplit& split);

/// run.json without its identity.
[[nodiscard]] nlohmann::json run_info(const Config& config, const std::vector<nlohmann::json>& devices,
                                      std::span<const MeasuredScene> scenes, const SweepSummary& summary,
                                      double started_ns, bool finished);

/// How this process was started.
[[nodiscard]] std::vector<std::string> command_line();

/// What the numbers depend on in this build: the shaders' texts and every stage's version (stages.h).
[[nodiscard]] std::string kernels_sha256(std::span<const StageVersion> stages = stage_versions());

/// Of a run's identity: the config with the files that it includes, and a device that it runs on.
[[nodiscard]] std::string config_sha256(const Config& config);
[[nodiscard]] nlohmann::json device_identity(const DeviceInfo& device);

}  // namespace reliefbench
