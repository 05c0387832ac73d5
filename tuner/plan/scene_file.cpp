#include "tuner/plan/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "tuner/plan/config_reader.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

/// Exact hits on the heights as stored: what is seen then is the features'.
constexpr std::string_view kUsualSetting = "cone?cone_steps=128";

constexpr std::array<std::string_view, 7> kSceneFileKeys{"$schema",  "about",   "scenes", "setting",
                                                         "features", "visible", "measure"};

Settings read_setting(const ConfigReader& reader, const JsonNode& node) {
  const std::string id = reader.text(node);
  return reader.at(node, [&] {
    Settings settings = parse_setting(id);
    if (!settings.technique().reads_map()) fail_input("'{}' displaces nothing: another technique is needed", id);
    if (const std::vector<PixelFeature> features = frame_features(settings); !features.empty())
      fail_input("'{}' has {}; which features are tried say 'features'", id, text_of(features));
    if (const std::string reason = conflict(settings); !reason.empty()) fail_input("{}", reason);
    return settings;
  });
}

std::vector<std::string> read_rows(const ConfigReader& reader, const JsonNode& node, const Feature& feature) {
  std::vector<std::string_view> known;
  for (const FeatureRow& row : feature.rows)
    if (&row != &feature.rows.front()) known.push_back(row.id);
  std::vector<std::string> rows;
  if (node.value.is_array() && node.children.empty()) return rows;  // it is not tried
  for (const JsonNode& item : reader.items(node)) {
    rows.push_back(reader.text(item));
    if (std::ranges::find(known, rows.back()) == known.end())
      reader.fail(item, fmt::format("'{}' is {}", rows.back(), unknown_text(rows.back(), known)));
  }
  return rows;
}

void read_features(const ConfigReader& reader, const JsonNode& node, SceneFile& file) {
  std::vector<std::string_view> known;
  for (const Feature& feature : all_features())
    if (feature.is_of_scene && file.setting.technique().find(feature.id) != nullptr) known.push_back(feature.id);
  reader.check_keys(node, known);
  for (const JsonNode& child : node.children)
    file.rows[child.key] =
        read_rows(reader, child, *std::ranges::find(all_features(), std::string_view(child.key), &Feature::id));
}

}  // namespace

void check_visible(const Budget& visible) {
  const MetricRow& metric = find_metric(visible.metric);
  if (!metric.compares_pictures || metric.none_is_best())
    fail_input("'{}': {} does not tell what is seen of every picture (expected flip, ssim or flicker)", visible.text(),
               visible.metric);
}

bool is_scene_file(const std::string& text, const std::filesystem::path& path) {
  const JsonNode root = parse_json_document(text, path.string());
  return root.value.is_object() && std::ranges::all_of(root.children, [](const JsonNode& child) {
           return std::ranges::find(kSceneFileKeys, child.key) != kSceneFileKeys.end();
         });
}

SceneFile load_scene_file(const std::filesystem::path& path) { return parse_scene_file(read_file(path), path); }

SceneFile parse_scene_file(const std::string& text, const std::filesystem::path& path) {
  const ConfigReader reader(path.string());
  const JsonNode root = parse_json_document(text, path.string());
  reader.check_keys(root, {kSceneFileKeys.begin(), kSceneFileKeys.end()});
  const JsonNode* const setting = root.find("setting");
  SceneFile file{.path = path,
                 .name = path.stem().string(),
                 .about = {},
                 .scenes = {},
                 .setting = setting == nullptr ? parse_setting(kUsualSetting) : read_setting(reader, *setting)};
  if (const JsonNode* about = root.find("about")) file.about = reader.text(*about);
  file.scenes = read_scenes(reader, reader.required(root, "scenes"), path.parent_path());
  if (const JsonNode* features = root.find("features")) read_features(reader, *features, file);
  if (const JsonNode* measure = root.find("measure")) file.measure = read_measure(reader, *measure);
  if (const JsonNode* visible = root.find("visible"))
    reader.at(*visible, [&] {
      file.visible = parse_budget(reader.text(*visible));
      check_visible(file.visible);
    });
  return file;
}

}  // namespace reliefbench
