#include "tuner/plan/preset_file.h"

#include <fmt/format.h>

#include <cstdint>
#include <set>

#include "kernels/base/error.h"
#include "tuner/plan/config_reader.h"
#include "tuner/plan/plan.h"
#include "tuner/plan/scene_json.h"

namespace reliefbench {
namespace {

using nlohmann::json;

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
                      {"samples", reader.integer(reader.required(node, "samples"), 1, INT32_MAX)},
                      {"error", number("error")}};
  if (const JsonNode* coarse = node.find("coarse_filter"))
    measurement["coarse_filter"] = reader.number(*coarse, {.low = 0});
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

std::string device_text(const LoadedPreset& preset) { return fmt::format("{} ({})", preset.backend, preset.device); }

std::string joined(const std::set<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

}  // namespace

std::vector<LoadedPreset> parse_presets(std::string_view text, std::string_view file) {
  const ConfigReader reader{std::string(file)};
  const JsonNode root = parse_json_document(text, file);
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
    if (preset.quality <= choice.quality && (found == nullptr || found->quality < preset.quality)) found = &preset;
  }
  if (meant.empty())
    fail_input("{}: no device '{}' of backend '{}' (it has {})", file, choice.device.empty() ? "*" : choice.device,
               choice.backend.empty() ? "*" : choice.backend, joined(all));
  if (meant.size() > 1)
    fail_input("{}: holds {} devices, choose one by --backend and --device-name: {}", file, meant.size(),
               joined(meant));
  if (found == nullptr || choice.quality > kBestPreset)
    fail_input("{}: there is no level {}; it has {}, and what is between two is the lower", file, choice.quality,
               fmt::join(levels, ", "));
  return *found;
}

}  // namespace reliefbench
