#pragma once
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tuner/decide/require.h"
#include "tuner/measure/require_run.h"
#include "tuner/plan/scene_file.h"
#include "tuner/plan/wanted_features.h"

namespace reliefbench {

/// The features of a scene as sets, each with the setting that draws it. Made from the rows alone.
struct SettingSpace {
  FeatureSpace space;
  std::vector<std::string> choices;                       ///< of each feature: "shadow=cone"
  std::vector<std::pair<FeatureSet, Settings>> settings;  ///< parallel to space.sets

  [[nodiscard]] const Settings& at(FeatureSet set) const;
};

/// Of all rows that bring the same the one whose picture, alone over the displaced relief, is nearest to the full
/// reference stands for it. value: of a setting's picture, lower is better; tried: is appended to
[[nodiscard]] SettingSpace setting_space(const SceneFile& file, const std::function<double(const Settings&)>& value,
                                         std::vector<TriedRow>& tried);

}  // namespace reliefbench
