#include "tuner/plan/preset_file.h"

#include <fmt/format.h>

#include <cstdint>
#include <set>

#include "kernels/base/error.h"
#include "tuner/plan/config_reader.h"
#include "tuner/plan/plan.h"

namespace reliefbench {
namespace {

using nlohmann::json;

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

std::string device_text(const LoadedPreset& preset) { return fmt::format("{} ({})", preset.backend, preset.device); }

std::string joined(const std::set<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

}  // namespace

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

const LoadedPreset& choose_preset(std::span<const LoadedPreset> presets, const PresetChoice& choice,
                                  std::string_view file) {
  const LoadedPreset* found = nullptr;
  std::set<std::string> all;
  std::set<std::string> meant;
  std::set<int> levels;
  for (const LoadedPreset& preset : presets) {
    all.insert(device_text(preset));
    if (!choice.backend.empty() && preset.backend != choice.backend) continue;
    if (!choice.device.empty() && !glob_matches(choice.device, preset.device)) continue;
    meant.insert(device_text(preset));
    levels.insert(preset.quality);
    if (preset.quality == choice.quality) found = &preset;
  }
  if (meant.empty())
    fail_input("{}: no device '{}' of backend '{}' (it has {})", file, choice.device.empty() ? "*" : choice.device,
               choice.backend.empty() ? "*" : choice.backend, joined(all));
  if (meant.size() > 1)
    fail_input("{}: holds {} devices, choose one by --backend and --device-name: {}", file, meant.size(),
               joined(meant));
  if (found == nullptr)
    fail_input("{}: there is no level {} (known: {})", file, choice.quality, fmt::join(levels, ", "));
  return *found;
}

}  // namespace reliefbench
