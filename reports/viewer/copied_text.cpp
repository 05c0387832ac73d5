#include "reports/viewer/copied_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "tuner/plan/preset_file.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/host.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

using nlohmann::json;

bool is_preset(const View& view) { return std::ranges::find(view_presets(), view) != view_presets().end(); }

Case case_of(const CopiedView& view) {
  return {.settings = view.choice->settings, .scene_id = viewed_scene_id(view.choice->spec), .backend = view.backend};
}

/// Only what differs from a config's defaults.
json config_heightmap(const HeightmapSpec& spec) {
  json heightmap = heightmap_json(spec);
  if (heightmap.contains("width")) heightmap.erase("channel");  // a procedural one has none
  return heightmap;
}

json config_view(const View& view) {
  if (is_preset(view)) return view.id;
  return {{"id", "view"},
          {"elevation_deg", view.elevation_deg},
          {"distance", view.distance},
          {"fov_deg", view.fov_deg},
          {"azimuth_deg", view.azimuth_deg}};
}

json config_json(const ViewChoice& choice) {
  const Scene& s = choice.spec.scene;
  json scene = {{"heightmap", config_heightmap(choice.spec.heightmap)},
                {"views", json::array({config_view(s.view)})},
                {"relief_depth", s.relief_depth},
                {"tiling", s.tiling},
                {"wrap", s.wrap == Wrap::repeat ? "repeat" : "clamp"},
                {"frame_px", {s.width_px, s.height_px}}};
  if (s.pan != 0) scene["pan"] = s.pan;
  if (s.light != Light{})
    scene["light"] = {{"elevation_deg", s.light.elevation_deg},
                      {"azimuth_deg", s.light.azimuth_deg},
                      {"angular_radius_deg", s.light.angular_radius_deg}};
  json axes = json::object();
  for (const SettingValue& given : choice.settings.values()) {
    if (given.param.choices.empty())
      axes[std::string(given.param.id)] = json::array({given.value});
    else
      axes[std::string(given.param.id)] = json::array({given.text()});
  }
  json sweep = {{"technique", choice.settings.technique().id}};
  if (!axes.empty()) sweep["axes"] = std::move(axes);
  return {{"name", "view"}, {"scenes", json::array({std::move(scene)})}, {"sweeps", json::array({std::move(sweep)})}};
}

json preset_json(const CopiedView& view) {
  if (view.times_ns.empty()) fail_input("a preset needs frame times, and no frame of this setting was drawn yet");
  SceneSpec spec = view.choice->spec;
  spec.id = viewed_scene_id(spec);
  if (!is_preset(spec.scene.view)) spec.scene.view.id = "view";
  const MeasuredScene scene{
      .spec = spec, .heights_sha256 = view.heights_sha256, .key = scene_key(view.heights_sha256, spec.scene)};
  const Summary time = summarise(view.times_ns);
  const json evidence = {
      {"scene", spec.id},       {"scene_key", scene.key.hex},        {"run", 0},          {"case", case_of(view).id()},
      {"time_ns", time.median}, {"ci", {time.ci_low, time.ci_high}}, {"samples", time.n}, {"error", view.error}};
  json params = json::object();
  for (const SettingValue& given : view.choice->settings.written()) params[std::string(given.param.id)] = given.text();
  const json level = {{"quality", kBestPreset},
                      {"technique", view.choice->settings.technique().id},
                      {"params", std::move(params)},
                      {"relative_time", 1},
                      {"error", view.error},
                      {"level_error", view.error},
                      {"evidence", json::array({evidence})}};
  const json device = {
      {"backend", view.backend},
      {"device", view.device},
      {"driver", view.driver},
      {"scenes",
       json::array({{{"scene", spec.id}, {"fastest_case", case_of(view).id()}, {"fastest_ns", time.median}}})},
      {"settings", {{"measured", 1}, {"shared", 1}, {"feasible", 1}, {"front", 1}}},
      {"levels", json::array({level})}};
  const json run = {{"folder", "view"}, {"name", "view"},      {"started", ""},
                    {"git_sha", ""},    {"config_sha256", ""}, {"kernels_sha256", ""}};
  return {{"schema", kPresetsSchema},
          {"made_by", fmt::format("reliefbench {} ({})", version(), git_sha())},
          {"error_metric", "e_xy.p99"},
          {"level_metric", "e_xy.p99"},
          {"constraints", json::array()},
          {"runs", json::array({run})},
          {"scenes", scenes_json({&scene, 1})},
          {"devices", json::array({device})},
          {"warnings", {"one view of the viewer, no sweep: nothing else was measured"}}};
}

}  // namespace

std::string viewed_scene_id(const SceneSpec& spec) {
  return fmt::format("{}/{}", heightmap_name(spec.heightmap), is_preset(spec.scene.view) ? spec.scene.view.id : "view");
}

std::string copied_text(std::string_view kind, const CopiedView& view) {
  if (kind == "case") return case_of(view).id() + "\n";
  const json document = kind == "config" ? config_json(*view.choice) : preset_json(view);
  return document.dump(1) + "\n";
}

}  // namespace reliefbench
