#include <array>
#include <nlohmann/json.hpp>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "tuner/plan/config_assets.h"
#include "tuner/plan/config_json.h"
#include "tuner/plan/plan.h"
#include "tuner/plan/scene_file.h"
#include "tuner/plan/wanted_features.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// Keys of a config's scene, and what the command line calls them.
struct Spelling {
  std::string_view key;
  std::string_view option;
};
constexpr std::array kSpellings{
    Spelling{"heightmap", "HEIGHTMAP"}, Spelling{"views", "--scene"}, Spelling{"relief_depth", "--relief-depth"},
    Spelling{"frame_px", "--frame-px"}, Spelling{"wrap", "--wrap"},   Spelling{"tiling", "--tiling"},
    Spelling{"base", "--base"}};

/// As a config's "heightmap" has it: what is as usual is left out.
json heightmap_value(const HeightmapSpec& spec) {
  const HeightmapSpec usual;
  json value = {{"source", spec.source}};
  if (spec.channel != usual.channel) value["channel"] = spec.channel;
  if (!spec.floor.empty()) value["floor"] = spec.floor;
  if (spec.invert) value["invert"] = true;
  if (spec.normalise) value["normalise"] = true;
  if (spec.width != usual.width) value["width"] = spec.width;
  if (spec.height != usual.height) value["height"] = spec.height;
  if (spec.seed != usual.seed) value["seed"] = spec.seed;
  return value.size() > 1 ? value : json(spec.source);
}

void apply(const SceneOptions& options, json& scene) {
  if (!options.views.empty()) scene["views"] = options.views;
  if (options.relief_depth) scene["relief_depth"] = *options.relief_depth;
  if (options.base) scene["base"] = *options.base;
  if (options.frame_px) scene["frame_px"] = {options.frame_px->width, options.frame_px->height};
  if (options.wrap) scene["wrap"] = *options.wrap;
  if (options.tiling) scene["tiling"] = *options.tiling;
}

/// A config that nobody wrote by hand: what is wrong with it was said on the command line, by another name.
Config parse_made(const json& config, const std::filesystem::path& path) {
  try {
    return parse_config(config.dump(1), path);
  } catch (const Error& error) {
    const std::string text = error.what();
    constexpr std::string_view kKey = "key 'scenes[";
    const std::size_t key = text.find(kKey);
    const std::size_t dot = key == std::string::npos ? key : text.find("].", key);
    const std::size_t end = dot == std::string::npos ? dot : text.find("': ", dot);
    if (end == std::string::npos) throw;
    const std::string_view path_in_scene = std::string_view(text).substr(dot + 2, end - dot - 2);
    for (const auto& [spelling, option] : kSpellings)
      if (path_in_scene.starts_with(spelling)) fail_input("{}: {}", option, text.substr(end + 3));
    throw;
  }
}

/// The space that heights are tuned in unless another is given: what traces solids has one of its own.
std::string_view space_name(const HeightmapSpec& heightmap) {
  return is_solid(heightmap) ? "solids.json" : "exhaustive.json";
}
json built_in_space(const HeightmapSpec& heightmap) {
  return json::parse(embedded_text(embedded_spaces(), std::string(space_name(heightmap))), nullptr, true,
                     /*ignore_comments=*/true);
}

/// A sweep once for each combination of rows that show all of it; none where its technique has no such feature.
std::vector<json> showing(const json& sweep, std::span<const WantedFeature> wanted) {
  if (!sweep.contains("technique")) fail_input("--features: a sweep of presets has the features that these have");
  const Technique& technique = find_technique(sweep.at("technique").get<std::string>());
  std::vector<json> all{sweep};
  for (const WantedFeature& one : wanted) {
    if (one.feature == nullptr) {
      if (!technique.reads_map()) return {};
      continue;
    }
    if (technique.find(one.feature->id) == nullptr) return {};
    std::vector<json> more;
    more.reserve(all.size() * one.rows.size());
    for (const json& before : all)
      for (const FeatureRow* row : one.rows) {
        more.push_back(before);
        json& axes = more.back()["axes"];
        for (const auto& [params, values] : axes.items())
          if (params != one.feature->id && params.find(one.feature->id) != std::string::npos)
            fail_input("--features {}: the config has it in an axis with others, '{}'", one.feature->id, params);
        axes[std::string(one.feature->id)] = row->id;
      }
    all = std::move(more);
  }
  return all;
}

}  // namespace

Config default_tune_config(const HeightmapSpec& heightmap, const SceneOptions& options) {
  json config = built_in_space(heightmap);
  json scene = config.at("scenes").at(0);
  scene["heightmap"] = heightmap_value(heightmap);
  scene["views"] = {scene.at("views").at(0)};
  scene.erase("frame_px");  // what draws them decides
  apply(options, scene);
  config["scenes"] = {std::move(scene)};
  config["name"] = "tune";
  return parse_made(config, space_name(heightmap));
}

Config scene_tune_config(const std::filesystem::path& path, const SceneOptions& options) {
  const SceneFile file = load_scene_file(path);  // says what is wrong with it
  json config = built_in_space(file.scenes.front().heightmap);
  config["name"] = file.name;
  config["scenes"] = json::parse(read_file(path), nullptr, true, /*ignore_comments=*/true).at("scenes");
  for (json& scene : listed_scenes(config)) apply(options, scene);
  config["front"] = {{"error", file.visible.metric}, {"constraints", json::array()}};
  config["budgets"] = {file.visible.text()};
  return parse_made(config, path);
}

Config with_features(const Config& config, std::string_view features) {
  const std::vector<WantedFeature> wanted = parse_wanted_features(features);
  json changed = json::parse(config.text, nullptr, true, /*ignore_comments=*/true);
  json sweeps = json::array();
  for (const json& sweep : changed.at("sweeps"))
    for (json& shown : showing(sweep, wanted)) sweeps.push_back(std::move(shown));
  changed["sweeps"] = sweeps;
  if (sweeps.empty()) fail_input("--features {}: no technique of {} has that", features, config.path.string());
  const Config with_all = parse_made(changed, config.path);
  changed["sweeps"] = json::array();
  for (std::size_t i = 0; i < sweeps.size(); ++i)
    if (has_settings(with_all.sweeps[i], config.path)) changed["sweeps"].push_back(sweeps[i]);
  if (changed["sweeps"].empty())
    fail_input("--features {}: no setting of {} goes with that", features, config.path.string());
  return parse_made(changed, config.path);
}

Config with_scene_options(const Config& config, const SceneOptions& options) {
  json changed = json::parse(config.text, nullptr, true, /*ignore_comments=*/true);
  const json before = listed_scenes(changed);
  for (json& scene : listed_scenes(changed)) apply(options, scene);
  return changed.at("scenes") == before ? config : parse_made(changed, config.path);
}

}  // namespace reliefbench
