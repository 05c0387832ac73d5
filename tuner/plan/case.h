#pragma once
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/image/heightmap.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"

namespace reliefbench {

/// A scene of a config: a heightmap seen from one view.
struct SceneSpec {
  std::string id;  ///< "<heightmap>/<view>", e.g. rocks/grazing
  HeightmapSpec heightmap;
  Scene scene;
  bool has_default_frame = false;  ///< its config does not say how large frames are: what draws them decides
};

/// "rocks/grazing: 8 degrees, 256x256 pixels, relief depth 0.1, repeat", with tiling and pan where they are not plain.
[[nodiscard]] std::string scene_description(const SceneSpec& spec);

/// One point of the space: what is drawn, where, with which settings.
struct Case {
  Settings settings;
  std::string scene_id;
  std::string backend;

  /// Canonical, defaults spelt out: `relief@rocks/grazing?linear_steps=16&...&backend=vulkan`. Filter, log key, link.
  [[nodiscard]] std::string id() const;
};

/// Whether compute shaders put the frames of any of them.
[[nodiscard]] bool has_compute(std::span<const Case> cases);

/// What identifies a bake: all settings with the same text share one map.
/// "<heightmap id>|<map>|correction=..|search_steps=..|heights=unorm8|wrap=repeat"
[[nodiscard]] std::string bake_text(const Settings& settings, const SceneSpec& scene);

/// The settings that a record's or a preset's texts name. params: parameter id -> text, of active parameters only
/// throws: Error(bad_input): an unknown technique, parameter or value, a parameter that is missing or inactive
[[nodiscard]] Settings settings_of(std::string_view technique,
                                   std::span<const std::pair<std::string, std::string>> params);

}  // namespace reliefbench
