#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "kernels/base/error.h"
#include "tuner/decide/presets.h"
#include "tuner/plan/config_reader.h"
#include "tuner/results/case_table.h"
#include "tuner/results/host.h"

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

/// One measurement. Files of earlier versions have no number of samples.
json read_measurement(const ConfigReader& reader, const JsonNode& node) {
  const auto number = [&](std::string_view key) { return reader.number(reader.required(node, key), {.low = 0}); };
  json ci = json::array();
  for (const JsonNode& end : reader.items(reader.required(node, "ci"))) ci.push_back(reader.number(end, {.low = 0}));
  json measurement = {{"scene", reader.text(reader.required(node, "scene"))},
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

LoadedPreset read_level(const ConfigReader& reader, const JsonNode& root, const JsonNode& device,
                        const JsonNode& level) {
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
          {"level_metric", presets.level_metric},
          {"constraints", constraints},
          {"runs", std::move(runs)},
          {"devices", std::move(devices)},
          {"warnings", presets.warnings}};
}

std::vector<LoadedPreset> parse_presets(std::string_view text, std::string_view file) {
  const ConfigReader reader{std::string(file)};
  const JsonNode root = parse_json_lines(text, file);
  const JsonNode& schema = reader.required(root, "schema");
  if (schema.value != kPresetsSchema)
    reader.fail(schema, fmt::format("is {}, this reliefbench reads {}", schema.value.dump(), kPresetsSchema));
  std::vector<LoadedPreset> presets;
  for (const JsonNode& device : reader.items(reader.required(root, "devices")))
    for (const JsonNode& level : reader.items(reader.required(device, "levels")))
      presets.push_back(read_level(reader, root, device, level));
  return presets;
}

}  // namespace reliefbench
