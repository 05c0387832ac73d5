#include "tuner/plan/case.h"

#include <fmt/format.h>

#include <array>

#include "kernels/base/error.h"
#include "kernels/maps/texel.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {
namespace {

std::string_view height_type(const Settings& settings) {
  // A technique without a format (flat) never reads its map, so it shares the first format's.
  const bool has_format = settings.technique().find("format") != nullptr;
  const Format& format = has_format ? find_format(settings.choice("format")) : formats().front();
  return texel_type_id(format.type);
}

}  // namespace

std::string Case::id() const {
  const std::string params = settings.text();
  return fmt::format("{}@{}?{}{}backend={}", settings.technique().id, scene_id, params, params.empty() ? "" : "&",
                     backend);
}

std::string bake_text(const Settings& settings, const SceneSpec& scene) {
  const Technique& technique = settings.technique();
  std::string text = fmt::format("{}|{}", heightmap_part(scene.id), map_of(settings).id);
  for (const Param& param : technique.params) {
    // Of a format only the type of its heights matters: cones are stored in it, not built from it.
    if (param.stage == Stage::bake && param.id != "format" && param.id != "map" && settings.is_active(param))
      text += fmt::format("|{}={}", param.id, param.text(settings.get(param.id)));
  }
  return text + fmt::format("|heights={}|wrap={}", height_type(settings),
                            scene.scene.wrap == Wrap::repeat ? "repeat" : "clamp");
}

Settings settings_of(std::string_view technique, std::span<const std::pair<std::string, std::string>> params) {
  Settings settings(find_technique(technique));
  for (const auto& [id, text] : params) settings.set(id, text);
  for (const auto& [id, text] : params)
    if (!settings.is_active(*settings.technique().find(id)))
      fail_input("parameter '{}' of '{}' means nothing without {}", id, technique,
                 settings.technique().find(id)->active_if);
  for (const Param& param : settings.technique().params) {
    const auto is_it = [&](const auto& given) { return given.first == param.id; };
    if (settings.is_active(param) && std::ranges::none_of(params, is_it))
      fail_input("parameter '{}' of '{}' is missing", param.id, technique);
  }
  return settings;
}

}  // namespace reliefbench
