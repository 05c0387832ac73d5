#pragma once
#include <nlohmann/json_fwd.hpp>

#include "tuner/plan/config.h"

namespace reliefbench {

/// A scene as a config's "scenes" have it: parse_config() reads the same one again. A view that is no preset's is
/// written whole; no preset may have its id.
[[nodiscard]] nlohmann::json config_scene_json(const SceneSpec& scene);

/// A config's "scenes" as a list, which one that stands alone becomes.
[[nodiscard]] nlohmann::json& listed_scenes(nlohmann::json& config);

/// A setting as a config's "sweeps" have it: a technique with one value an axis.
[[nodiscard]] nlohmann::json config_sweep_json(const Settings& settings);

/// Whether a view is one of view_presets().
[[nodiscard]] bool is_preset(const View& view);

}  // namespace reliefbench
