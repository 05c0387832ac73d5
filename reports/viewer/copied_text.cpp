#include "reports/viewer/copied_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "tuner/plan/config_json.h"
#include "tuner/plan/preset_file.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/host.h"
#include "tuner/results/json_text.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

using nlohmann::json;

Case case_of(const CopiedView& view) {
  return {.settings = view.choice->settings, .scene_id = viewed_scene_id(view.choice->spec), .backend = view.backend};
}

/// What is seen, with its own names.
SceneSpec viewed_spec(const ViewChoice& choice) {
  SceneSpec spec = choice.spec;
  spec.id = viewed_scene_id(spec);
  if (!is_preset(spec.scene.view)) spec.scene.view.id = "view";
  return spec;
}

json config_json(const ViewChoice& choice) {
  return {{"name", "view"},
          {"scenes", json::array({config_scene_json(viewed_spec(choice))})},
          {"sweeps", json::array({config_sweep_json(choice.settings)})}};
}

json preset_json(const CopiedView& view) {
  if (view.times_ns.empty()) fail_input("a preset needs frame times, and no frame of this setting was drawn yet");
  const SceneSpec spec = viewed_spec(*view.choice);
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
  return json_text(document, 1) + "\n";
}

}  // namespace reliefbench
