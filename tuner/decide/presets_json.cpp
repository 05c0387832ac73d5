#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/error.h"
#include "tuner/decide/presets.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/host.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

using nlohmann::json;

json run_json(const Run& run) {
  const json identity = run.info.value("identity", json::object());
  return {{"folder", run.folder.string()},
          {"name", run.info.value("name", "")},
          {"started", run.info.value("started", "")},
          {"git_sha", run.info.value("git_sha", "")},
          {"config_sha256", identity.value("config_sha256", "")},
          {"kernels_sha256", identity.value("kernels_sha256", "")}};
}

json evidence_json(const PresetEvidence& evidence, const Presets& presets) {
  const Record& record = *evidence.record;
  const Summary& time = record.frame_time->summary;
  return {{"scene", record.scene},
          {"scene_key", record.scene_key.hex},
          {"run", std::ranges::find(presets.runs, evidence.run) - presets.runs.begin()},
          {"case", record.case_id},
          {"time_ns", time.median},
          {"ci", {time.ci_low, time.ci_high}},
          {"samples", time.n},
          {"error", evidence.error},
          {"coarse_filter", evidence.filter().error_of(settings_of(record.technique, record.params))}};
}

json level_json(const PresetLevel& level, const Presets& presets) {
  const Record& record = *level.evidence.front().record;
  json params = json::object();
  for (const auto& [id, text] : record.params) params[id] = text;
  json evidence = json::array();
  for (const PresetEvidence& one : level.evidence) evidence.push_back(evidence_json(one, presets));
  return {{"quality", level.quality},       {"technique", record.technique},
          {"params", std::move(params)},    {"relative_time", level.relative_time},
          {"error", level.error},           {"level_error", level.level_error},
          {"evidence", std::move(evidence)}};
}

json device_json(const DevicePresets& device, const Presets& presets) {
  json scenes = json::array();
  for (const SceneFloor& floor : device.scenes)
    scenes.push_back({{"scene", floor.scene},
                      {"fastest_case", floor.fastest->case_id},
                      {"fastest_ns", floor.fastest->frame_time->summary.median}});
  json levels = json::array();
  for (const PresetLevel& level : device.levels) levels.push_back(level_json(level, presets));
  return {{"backend", device.backend},
          {"device", device.device},
          {"driver", device.driver},
          {"scenes", std::move(scenes)},
          {"settings",
           {{"measured", device.measured},
            {"shared", device.shared},
            {"feasible", device.feasible},
            {"front", device.on_front}}},
          {"levels", std::move(levels)}};
}

json common_json(const CommonPresets& common) {
  json places = json::array();
  for (const FleetPlace& place : common.places)
    places.push_back({{"backend", place.device.backend},
                      {"device", place.device.device},
                      {"scene", place.scene},
                      {"scene_key", place.scene_key.hex}});
  const auto priced = [](const Loss& loss) -> json {
    return {{"slower_by", loss.value}, {"interval", {loss.low, loss.high}}};
  };
  json levels = json::array();
  for (const CommonLevel& level : common.levels) {
    json prices = json::array();
    for (const Loss& loss : level.losses) {
      prices.push_back(priced(loss));
      prices.back()["time_ns"] = loss.time_ns;
    }
    levels.push_back({{"quality", level.quality},
                      {"level_error", level.level_error},
                      {"combined", priced(level.combined)},
                      {"places", std::move(prices)}});
  }
  return {{"regret", regret_id(common.regret)}, {"places", std::move(places)}, {"levels", std::move(levels)}};
}

/// The scenes that evidence is of, each whole.
json scenes_of(const Presets& presets) {
  std::vector<MeasuredScene> scenes;
  for (const DevicePresets& device : presets.devices)
    for (const PresetLevel& level : device.levels)
      for (const PresetEvidence& one : level.evidence) {
        const SceneKey& key = one.record->scene_key;
        if (find_scene(scenes, key) != nullptr) continue;
        const MeasuredScene* const scene = find_scene(one.run->scenes, key);
        if (scene == nullptr)
          fail_input("{}: key 'scenes': has no scene '{}' with the key {}", (one.run->folder / kRunFile).string(),
                     one.record->scene, key.short_text());
        scenes.push_back(*scene);
      }
  return scenes_json(scenes);
}

}  // namespace

json presets_json(const Presets& presets) {
  json runs = json::array();
  for (const Run* run : presets.runs) runs.push_back(run_json(*run));
  json devices = json::array();
  for (const DevicePresets& device : presets.devices) devices.push_back(device_json(device, presets));
  json made = {{"schema", kPresetsSchema},
               {"made_by", fmt::format("reliefbench {} ({})", version(), git_sha())},
               {"error_metric", presets.error_metric},
               {"level_metric", presets.level_metric},
               {"constraints", budget_texts(presets.constraints)},
               {"runs", std::move(runs)},
               {"scenes", scenes_of(presets)},
               {"devices", std::move(devices)},
               {"warnings", presets.warnings},
               {"filter_notes", coarse_notes(presets)}};
  if (presets.common) made["common"] = common_json(*presets.common);
  return made;
}

}  // namespace reliefbench
