#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "kernels/base/error.h"
#include "tuner/decide/presets.h"
#include "tuner/plan/config_reader.h"
#include "tuner/results/case_table.h"
#include "tuner/results/host.h"
#include "tuner/results/run_files.h"
#include "tuner/plan/scene_json.h"

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
  const Summary& time = evidence.record->frame_time->summary;
  return {{"scene", evidence.record->scene},
          {"scene_key", evidence.record->scene_key.hex},
          {"run", std::ranges::find(presets.runs, evidence.run) - presets.runs.begin()},
          {"case", evidence.record->case_id},
          {"time_ns", time.median},
          {"ci", {time.ci_low, time.ci_high}},
          {"samples", time.n},
          {"error", evidence.error}};
}

json level_json(const PresetLevel& level, const Presets& presets) {
  const Record& record = *level.evidence.front().record;
  json params = json::object();
  for (const auto& [id, text] : record.params) params[id] = text;
  json evidence = json::array();
  for (const PresetEvidence& one : level.evidence) evidence.push_back(evidence_json(one, presets));
  return {{"quality", level.quality},    {"technique", record.technique},
          {"params", std::move(params)}, {"relative_time", level.relative_time},
          {"error", level.error},        {"evidence", std::move(evidence)}};
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

/// The node's value with its children in it.
json whole_value(const JsonNode& node) {
  json value = node.value;
  for (const JsonNode& child : node.children) {
    if (value.is_array())
      value.push_back(whole_value(child));
    else
      value[child.key] = whole_value(child);
  }
  return value;
}

/// One measurement.
json read_measurement(const ConfigReader& reader, const JsonNode& node) {
  const auto number = [&](std::string_view key) { return reader.number(reader.required(node, key), {.low = 0}); };
  json ci = json::array();
  for (const JsonNode& end : reader.items(reader.required(node, "ci"))) ci.push_back(reader.number(end, {.low = 0}));
  json measurement = {{"scene", reader.text(reader.required(node, "scene"))},
                      {"scene_key", reader.text(reader.required(node, "scene_key"))},
                      {"case", reader.text(reader.required(node, "case"))},
                      {"time_ns", number("time_ns")},
                      {"ci", std::move(ci)},
                      {"error", number("error")}};
  if (const JsonNode* samples = node.find("samples")) measurement["samples"] = reader.integer(*samples, 1, INT32_MAX);
  return measurement;
}

/// What a level rests on, as far as the file says.
json read_evidence(const ConfigReader& reader, const JsonNode& root, const JsonNode& device, const JsonNode& level) {
  json evidence = {{"backend", reader.text(reader.required(device, "backend"))},
                   {"device", reader.text(reader.required(device, "device"))},
                   {"quality", reader.integer(reader.required(level, "quality"), 0, 100)},
                   {"scenes", json::array()}};
  for (const auto& [node, key] : {std::pair(&root, "error_metric"), std::pair(&device, "driver")})
    if (const JsonNode* text = node->find(key)) evidence[key] = reader.text(*text);
  for (const char* key : {"relative_time", "error"})
    if (const JsonNode* number = level.find(key)) evidence[key] = reader.number(*number, {.low = 0});
  if (const JsonNode* list = level.find("evidence"))
    for (const JsonNode& one : reader.items(*list)) evidence["scenes"].push_back(read_measurement(reader, one));
  return evidence;
}

/// The scenes of a level's measurements.
std::vector<MeasuredScene> read_scenes(const ConfigReader& reader, const JsonNode& level,
                                       std::span<const MeasuredScene> all) {
  std::vector<MeasuredScene> scenes;
  const JsonNode* const list = level.find("evidence");
  if (list == nullptr) return scenes;
  for (const JsonNode& one : reader.items(*list)) {
    const JsonNode& node = reader.required(one, "scene_key");
    const SceneKey key = reader.at(node, [&] { return parse_scene_key(reader.text(node)); });
    const MeasuredScene* const scene = find_scene(all, key);
    if (scene == nullptr) reader.fail(node, fmt::format("no scene of the file has the key {}", key.short_text()));
    scenes.push_back(*scene);
  }
  return scenes;
}

LoadedPreset read_level(const ConfigReader& reader, const JsonNode& root, const JsonNode& device, const JsonNode& level,
                        std::span<const MeasuredScene> scenes) {
  const JsonNode& technique = reader.required(level, "technique");
  const std::string id = reader.text(technique);
  Settings known(*reader.at(technique, [&] { return &find_technique(id); }));
  const JsonNode& params = reader.required(level, "params");
  if (!params.value.is_object()) reader.fail(params, "expected an object");
  std::vector<std::pair<std::string, std::string>> texts;
  for (const JsonNode& param : params.children) {
    texts.emplace_back(param.key, reader.text(param));
    reader.at(param, [&] { known.set(param.key, texts.back().second); });
  }
  json evidence = read_evidence(reader, root, device, level);
  LoadedPreset preset{.backend = evidence["backend"],
                      .device = evidence["device"],
                      .quality = evidence["quality"],
                      .settings = reader.at(params, [&] { return settings_of(id, texts); })};
  preset.evidence = std::move(evidence);
  preset.scenes = read_scenes(reader, level, scenes);
  return preset;
}

}  // namespace

json presets_json(const Presets& presets) {
  std::vector<std::string> constraints;
  for (const Budget& budget : presets.constraints) constraints.push_back(budget.text());
  json runs = json::array();
  for (const Run* run : presets.runs) runs.push_back(run_json(*run));
  json devices = json::array();
  for (const DevicePresets& device : presets.devices) devices.push_back(device_json(device, presets));
  return {{"schema", kPresetsSchema},
          {"made_by", fmt::format("reliefbench {} ({})", version(), git_sha())},
          {"error_metric", presets.error_metric},
          {"constraints", constraints},
          {"runs", std::move(runs)},
          {"scenes", scenes_of(presets)},
          {"devices", std::move(devices)}};
}

std::vector<LoadedPreset> parse_presets(std::string_view text, std::string_view file) {
  const ConfigReader reader{std::string(file)};
  const JsonNode root = parse_json_lines(text, file);
  const JsonNode& schema = reader.required(root, "schema");
  if (schema.value != kPresetsSchema)
    reader.fail(schema, fmt::format("is {}, this reliefbench reads {}; make the presets anew", schema.value.dump(),
                                    kPresetsSchema));
  const JsonNode& list = reader.required(root, "scenes");
  const std::vector<MeasuredScene> scenes = reader.at(list, [&] { return parse_scenes(whole_value(list)); });
  std::vector<LoadedPreset> presets;
  for (const JsonNode& device : reader.items(reader.required(root, "devices")))
    for (const JsonNode& level : reader.items(reader.required(device, "levels")))
      presets.push_back(read_level(reader, root, device, level, scenes));
  return presets;
}

}  // namespace reliefbench
