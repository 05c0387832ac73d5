#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "kernels/base/append_file.h"
#include "tuner/plan/config_reader.h"
#include "tuner/plan/preset_file.h"

namespace reliefbench {
namespace {

/// A sweep of nothing but these settings.
SweepSpec sweep_of(const Settings& settings, int line) {
  SweepSpec sweep{.technique = &settings.technique(), .axes = {}, .where = {}, .line = line};
  for (const auto& [param, value] : settings.values())
    sweep.axes.push_back({.params = {std::string(param.id)}, .values = {{value}}});
  return sweep;
}

/// Leaves those of one device.
void keep_device(const ConfigReader& reader, const JsonNode& node, std::vector<LoadedPreset>& presets) {
  const std::string device = reader.text(node);
  std::set<std::string_view> known;
  for (const LoadedPreset& preset : presets) {
    known.insert(preset.backend);
    known.insert(preset.device);
  }
  if (!known.contains(device))
    reader.fail(node, fmt::format("'{}' is {}", device, unknown_text(device, {known.begin(), known.end()})));
  std::erase_if(presets, [&](const LoadedPreset& p) { return p.backend != device && p.device != device; });
}

/// Leaves of each device, for each quality that is asked for, the best level that is no higher.
void keep_quality(const ConfigReader& reader, const JsonNode& node, std::vector<LoadedPreset>& presets) {
  std::map<std::pair<std::string, std::string>, std::set<int>> levels;
  for (const LoadedPreset& preset : presets) levels[{preset.backend, preset.device}].insert(preset.quality);
  std::map<std::pair<std::string, std::string>, std::set<int>> wanted;
  for (const JsonNode& item : reader.items(node)) {
    const auto quality = static_cast<int>(reader.integer(item, 0, 100));
    for (const auto& [device, known] : levels) {
      const auto above = known.upper_bound(quality);
      if (above == known.begin())
        reader.fail(item, fmt::format("there is no level up to {} (known: {})", quality, fmt::join(known, ", ")));
      wanted[device].insert(*std::prev(above));
    }
  }
  std::erase_if(presets, [&](const LoadedPreset& preset) {
    return !wanted[{preset.backend, preset.device}].contains(preset.quality);
  });
}

}  // namespace

void read_presets_sweep(const ConfigReader& reader, const JsonNode& node, Config& config) {
  reader.check_object(node, "presets_sweep");
  const JsonNode& file = reader.required(node, "presets");
  const std::filesystem::path path = config.path.parent_path() / reader.text(file);
  const std::string text = reader.at(file, [&] { return read_file(path); });
  std::vector<LoadedPreset> presets = parse_presets(text, path.string());
  if (const JsonNode* device = node.find("device")) keep_device(reader, *device, presets);
  if (const JsonNode* quality = node.find("quality")) keep_quality(reader, *quality, presets);
  for (const LoadedPreset& preset : presets) config.sweeps.push_back(sweep_of(preset.settings, node.line));
  config.included.push_back(text);
}

}  // namespace reliefbench
