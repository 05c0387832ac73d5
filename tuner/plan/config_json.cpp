#include "tuner/plan/config_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tuner/plan/scene_json.h"

namespace reliefbench {
namespace {

using nlohmann::json;

json config_heightmap(const HeightmapSpec& spec) {
  json heightmap = heightmap_json(spec);
  if (heightmap.contains("seed")) heightmap.erase("channel");  // a procedural one has none
  return heightmap;
}

}  // namespace

bool is_preset(const View& view) { return std::ranges::find(view_presets(), view) != view_presets().end(); }

json config_scene_json(const SceneSpec& scene) {
  const Scene& s = scene.scene;
  json written = {{"heightmap", config_heightmap(scene.heightmap)},
                  {"views", json::array({is_preset(s.view) ? json(s.view.id) : view_json(s.view)})},
                  {"relief_depth", s.relief_depth},
                  {"tiling", s.tiling},
                  {"wrap", wrap_id(s.wrap)},
                  {"frame_px", {s.width_px, s.height_px}}};
  if (s.pan != 0) written["pan"] = s.pan;
  if (s.light != Light{}) written["light"] = light_json(s.light);
  if (s.reference != Picture::point) written["reference"] = picture_id(s.reference);
  if (s.occluded != 0) written["occluded"] = s.occluded;
  if (s.base != 1) written["base"] = s.base;
  if (s.surface != Surface{}) written["surface"] = surface_json(s.surface);
  return written;
}

json& listed_scenes(json& config) {
  json& scenes = config.at("scenes");
  if (!scenes.is_array()) scenes = json::array({scenes});
  return scenes;
}

json config_sweep_json(const Settings& settings) {
  json axes = json::object();
  for (const SettingValue& given : settings.values())
    axes[std::string(given.param.id)] =
        json::array({given.param.choices.empty() ? json(given.value) : json(given.text())});
  json sweep = {{"technique", settings.technique().id}};
  if (!axes.empty()) sweep["axes"] = std::move(axes);
  return sweep;
}

}  // namespace reliefbench
