#include "tuner/measure/run_info.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/clock.h"
#include "kernels/base/embedded.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "kernels/trace/shader_contract.h"
#include "kernels/trace/technique.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/block_state.h"
#include "tuner/results/device_json.h"
#include "tuner/results/frame_fill.h"
#include "tuner/results/host.h"
#include "tuner/results/run_files.h"

namespace reliefbench {

std::vector<std::string> command_line() {
  std::vector<std::string> arguments;
  std::string text;
  if (FILE* file = std::fopen("/proc/self/cmdline", "rb"); file != nullptr) {
    for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) text += static_cast<char>(c);
    std::fclose(file);
  }
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t to = std::min(text.find('\0', from), text.size());
    arguments.push_back(text.substr(from, to - from));
    from = to + 1;
  }
  return arguments;
}

std::string kernels_sha256(std::span<const StageVersion> stages) {
  std::string text;
  for (const StageVersion& stage : stages) text += fmt::format("{} {}\n", stage.id, stage.version);
  text += shared_contract();
  for (const Technique& technique : techniques()) text += parameters_contract(technique);
  for (const EmbeddedFile& file : embedded_shaders()) text += fmt::format("{}\n{}\n", file.name, file.text);
  return sha256(text);
}

std::string config_sha256(const Config& config) {
  return sha256(fmt::format("{}{}", config.text, fmt::join(config.included, "")));
}

nlohmann::json device_identity(const DeviceInfo& device) {
  return {{"backend", device.backend}, {"index", device.index}, {"name", device.name}, {"driver", device.driver}};
}

void set_costs(SweepSummary& summary, const MapLibrary& library, const WallSplit& split) {
  summary.bakes = library.baked();
  summary.bakes_cached = library.from_cache();
  summary.total_s = split.total_seconds();
  summary.other_s = summary.total_s;
  for (std::size_t i = 0; i < kPartIds.size(); ++i) {
    summary.part_s.at(i) = split.seconds(static_cast<Part>(i));
    summary.other_s -= summary.part_s.at(i);
  }
}

nlohmann::json device_json(const Session& session) {
  nlohmann::json device = device_json(session.device());
  device["audit"] = audit_json(session.audit());
  device["filter"] = filter_json(session.filter_audit());
  const Calibration& calibration = session.calibration();
  device["timer"] = timer_id(calibration.timer);
  device["control_load_steps"] = calibration.load_steps;
  device["control_frames"] = calibration.frames;
  device["control_reference_ns"] = calibration.reference_ns;
  if (calibration.state.is_told()) device["control_state"] = state_json(calibration.state);
  if (!session.fills().empty()) device["frame_fill"] = fills_json(session.fills());
  return device;
}

std::optional<Calibration> known_calibration(const nlohmann::json& info, const DeviceInfo& device) {
  const nlohmann::json entry = device_of(info, device.backend);
  if (entry.empty()) return std::nullopt;
  for (const char* key : {"timer", "control_load_steps", "control_frames", "control_reference_ns"})
    if (!entry.contains(key)) fail_input("{}: key 'devices': '{}' of {} is missing", kRunFile, key, device.backend);
  for (const Timer timer : device.timers)
    if (timer_id(timer) == entry.at("timer").get<std::string>())
      return Calibration{.timer = timer,
                         .load_steps = entry.at("control_load_steps"),
                         .frames = entry.at("control_frames"),
                         .reference_ns = entry.at("control_reference_ns"),
                         .state = parse_state(entry.value("control_state", nlohmann::json::object()))};
  return std::nullopt;
}

nlohmann::json run_info(const Config& config, const std::vector<nlohmann::json>& devices,
                        std::span<const MeasuredScene> scenes, const SweepSummary& summary, double started_ns,
                        bool finished) {
  nlohmann::json wall_s = {{"other", summary.other_s}, {"total", summary.total_s}};
  for (std::size_t i = 0; i < kPartIds.size(); ++i) wall_s[std::string(kPartIds.at(i))] = summary.part_s.at(i);
  nlohmann::json info = {
      {"name", config.name},
      {"version", version()},
      {"git_sha", git_sha()},
      {"argv", command_line()},
      {"started", utc_text(started_ns)},
      {"started_unix_ns", started_ns},
      {"host", host_json()},
      {"config_path", config.path.string()},
      {"config", nlohmann::json::parse(config.text, nullptr, true, /*ignore_comments=*/true)},
      {"seed", config.seed},
      {"scenes", scenes_json(scenes)},
      {"devices", devices},
      {"wall_s", wall_s},
      {"counts",
       {{"cases", summary.cases},
        {"resumed", summary.resumed},
        {"statuses", summary.statuses},
        {"bakes", summary.bakes},
        {"bakes_cached", summary.bakes_cached},
        {"references", summary.references},
        {"references_cached", summary.references_cached},
        {"shaders", summary.shaders},
        {"shaders_cached", summary.shaders_cached}}},
      {"front", {{"error", config.front_error}, {"constraints", budget_texts(config.front_constraints)}}},
      {"budgets", budget_texts(config.budgets)}};
  info["finished"] = finished ? nlohmann::json(utc_text(unix_ns())) : nlohmann::json(nullptr);
  return info;
}

}  // namespace reliefbench
