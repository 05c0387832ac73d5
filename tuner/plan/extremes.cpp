#include "tuner/plan/extremes.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <set>

#include "kernels/base/append_file.h"
#include "kernels/base/embedded.h"
#include "kernels/base/error.h"
#include "kernels/maps/map_kind.h"
#include "tuner/plan/config_assets.h"
#include "tuner/plan/config_reader.h"

namespace reliefbench {
namespace {

std::string value_text(const ConfigReader& reader, const JsonNode& node) {
  return node.value.is_number_integer() ? fmt::format("{}", reader.integer(node, 0, 4096)) : reader.text(node);
}

bool is_parameter(std::string_view id) {
  return id == "steps" || std::ranges::any_of(techniques(), [&](const Technique& t) { return t.find(id) != nullptr; });
}

std::vector<SettingChange> read_changes(const ConfigReader& reader, const JsonNode& node) {
  if (!node.value.is_object()) reader.fail(node, "expected an object of parameters");
  std::vector<SettingChange> changes;
  for (const JsonNode& child : node.children) {
    if (!is_parameter(child.key)) reader.fail(child, "no technique has this parameter");
    changes.emplace_back(child.key, value_text(reader, child));
  }
  return changes;
}

Extreme read_extreme(const ConfigReader& reader, const JsonNode& node, const std::filesystem::path& folder) {
  reader.check_keys(node, {"id", "about", "scene", "settings", "large"});
  const JsonNode& scene = reader.required(node, "scene");
  std::vector<SceneSpec> scenes = read_scene(reader, scene, folder);
  if (scenes.size() != 1) reader.fail(scene, "expected one view");
  Extreme extreme{.id = reader.text(reader.required(node, "id")),
                  .about = reader.text(reader.required(node, "about")),
                  .scene = std::move(scenes.front())};
  if (const JsonNode* settings = node.find("settings")) extreme.changes = read_changes(reader, *settings);
  if (const JsonNode* large = node.find("large")) extreme.is_large = reader.flag(*large);
  return extreme;
}

void set_if_known(Settings& settings, std::string_view id, const std::string& text) {
  const Param* const param = settings.technique().find(id);
  if (param == nullptr) return;
  if (param->choices.empty()) {
    int value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    settings.set(id, std::clamp(value, param->min, param->max));
  } else if (std::ranges::find(param->choices, text) != param->choices.end()) {
    settings.set(id, std::string_view(text));
  }
}

}  // namespace

Extremes parse_extremes(const std::string& text, const std::filesystem::path& path) {
  const ConfigReader reader(path.string());
  const JsonNode root = parse_json_document(text, path.string());
  reader.check_keys(root, {"frame_px", "settings", "extremes"});
  Extremes extremes;
  if (const JsonNode* settings = root.find("settings")) extremes.changes = read_changes(reader, *settings);
  const JsonNode& frame = reader.required(root, "frame_px");
  if (frame.children.size() != 2) reader.fail(frame, "expected [width, height]");
  std::set<std::string> ids;
  for (const JsonNode& item : reader.items(reader.required(root, "extremes"))) {
    Extreme extreme = read_extreme(reader, item, path.parent_path());
    extreme.scene.scene.width_px = static_cast<int>(reader.integer(frame.children[0], 1, 1024));
    extreme.scene.scene.height_px = static_cast<int>(reader.integer(frame.children[1], 1, 1024));
    if (!ids.insert(extreme.id).second) reader.fail(item, fmt::format("a second extreme '{}'", extreme.id));
    extremes.list.push_back(std::move(extreme));
  }
  return extremes;
}

Extremes load_extremes(const std::filesystem::path& path) { return parse_extremes(read_file(path), path); }

Extremes built_in_extremes() {
  return parse_extremes(std::string(embedded_text(embedded_extremes(), kBuiltInExtremes)),
                        "configs/extremes/standard.json");
}

void apply(const std::vector<SettingChange>& changes, Settings& settings) {
  for (const auto& [id, text] : changes) {
    if (id != "steps") {
      set_if_known(settings, id, text);
      continue;
    }
    for (const Param& param : settings.technique().params)
      if (param.counts_steps()) set_if_known(settings, param.id, text);
  }
}

std::vector<Settings> stress_settings(const Technique& technique, const std::vector<SettingChange>& all,
                                      const Extreme& extreme) {
  Settings usual(technique);
  apply(all, usual);
  apply(extreme.changes, usual);
  const auto choices = [&](std::string_view id) -> std::vector<std::string_view> {
    const Param* const param = technique.find(id);
    return param == nullptr ? std::vector<std::string_view>() : param->choices;
  };
  std::vector<Settings> list;
  std::set<std::string> seen;
  const auto add = [&](const Settings& settings) {
    if (conflict(settings, extreme.scene.scene, is_solid(extreme.scene.heightmap)).empty() &&
        seen.insert(settings.text()).second)
      list.push_back(settings);
  };
  const auto vary = [&](const Settings& from, std::string_view id, const auto& use) {
    const std::vector<std::string_view> values = choices(id);
    if (values.empty()) use(from);
    for (const std::string_view value : values) {
      Settings settings = from;
      settings.set(id, value);
      use(settings);
    }
  };
  vary(usual, "search", [&](const Settings& s) { vary(s, "map", [&](const Settings& m) { vary(m, "format", add); }); });
  if (!extreme.is_large) {
    for (const std::string_view id : {"encoding", "correction", "step", "over_relaxation", "steps_by", "dither",
                                      "filter", "refinement", "lod", "shadow", "depth", "silhouette", "dispatch"})
      vary(usual, id, add);
    Settings plain = usual;  // beyond cones whose ends no cell's solution hides
    set_if_known(plain, "step", "plain");
    const auto add_strides = [&](const Settings& s) { vary(s, "over_relaxation", add); };
    add_strides(plain);
    for (const MapRow& map : map_kinds())
      for (const MapParam& param : map.parameters)
        for (const Settings& steps : {usual, plain}) vary(steps, param.id, add_strides);
  }
  add(usual);
  return list;
}

}  // namespace reliefbench
