#include "tuner/plan/case.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/error.h"
#include "kernels/maps/texel.h"
#include "kernels/trace/surface.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {

std::string scene_description(const SceneSpec& spec) {
  const Scene& scene = spec.scene;
  std::string text =
      fmt::format("{}: {:g} degrees, {}x{} pixels, relief depth {:g}, {}", spec.id, scene.view.elevation_deg,
                  scene.width_px, scene.height_px, scene.relief_depth, wrap_id(scene.wrap));
  if (scene.tiling != 1) text += fmt::format(", {:g} tiles a side", scene.tiling);
  if (const Light& light = scene.light; light != Light{})
    text += fmt::format(", light at {:g}/{:g} degrees", light.elevation_deg, light.azimuth_deg);
  if (scene.light.angular_radius_deg != 0) text += fmt::format(" of radius {:g}", scene.light.angular_radius_deg);
  if (scene.reference != Picture::point) text += fmt::format(", {} reference", picture_id(scene.reference));
  if (scene.occluded != 0) text += fmt::format(", {:g} % of it hidden", 100 * scene.occluded);
  if (scene.base != 1) text += fmt::format(", base {:g}", scene.base);
  if (is_curved(scene.surface.kind)) text += fmt::format(", on a {}", surface_text(scene.surface));
  if (scene.pan != 0) text += fmt::format(", panned by {:g}", scene.pan);
  return text;
}

std::string Case::id() const {
  const std::string params = settings.text();
  return fmt::format("{}@{}?{}{}backend={}", settings.technique().id, scene_id, params, params.empty() ? "" : "&",
                     backend);
}

bool has_compute(std::span<const Case> cases) {
  return std::ranges::any_of(cases, [](const Case& c) { return is_by_compute(c.settings); });
}

std::string bake_text(const Settings& settings, const SceneSpec& scene) {
  std::string text = fmt::format("{}|{}", heightmap_part(scene.id), map_of(settings).id);
  for (const SettingValue& given : settings.values()) {
    const Param& param = given.param;
    // Of a format only the type of its heights matters: cones are stored in it, not built from it.
    if (param.stage == Stage::bake && param.id != "format" && param.id != "map")
      text += fmt::format("|{}={}", param.id, given.text());
  }
  return text +
         fmt::format("|heights={}|wrap={}", texel_type_id(storage_of(settings).format.type), wrap_id(scene.scene.wrap));
}

Settings settings_of(std::string_view technique, std::span<const std::pair<std::string, std::string>> params) {
  Settings settings(find_technique(technique));
  for (const auto& [id, text] : params) settings.set(id, text);
  for (const auto& [id, text] : params)
    if (settings.active(id) == nullptr)
      fail_input("parameter '{}' of '{}' means nothing without {}", id, technique,
                 settings.technique().find(id)->active_if);
  for (const SettingValue& written : settings.written()) {
    const auto is_it = [&](const auto& given) { return given.first == written.param.id; };
    if (std::ranges::none_of(params, is_it))
      fail_input("parameter '{}' of '{}' is missing", written.param.id, technique);
  }
  return settings;
}

}  // namespace reliefbench
