#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tuner/plan/config.h"

namespace reliefbench {

/// A scene that is asked what it requires: configs/scenes/*.json.
struct SceneFile {
  std::filesystem::path path{};
  std::string name{};
  std::string about{};              ///< in words; "": not said
  std::vector<SceneSpec> scenes{};  ///< its views, each under its light
  Settings setting;                 ///< what displaces the relief, without features of the scene
  /// By feature: the rows that may be used, in the file's order; a feature that is not named may use all of its rows.
  std::map<std::string, std::vector<std::string>, std::less<>> rows{};
  Budget visible{.metric = "flip", .limit = 0.01};  ///< what nobody sees
  MeasureSpec measure{};
};
/// throws: Error(bad_input) "FILE:LINE: key 'a.b': what was expected"
[[nodiscard]] SceneFile load_scene_file(const std::filesystem::path& path);
[[nodiscard]] SceneFile parse_scene_file(const std::string& text, const std::filesystem::path& path);

/// Whether JSON is a scene file and no config. throws: Error(bad_input): it is no JSON
[[nodiscard]] bool is_scene_file(const std::string& text, const std::filesystem::path& path);

/// Whether a bound is on something that people see of a picture. throws: Error(bad_input), if not
void check_visible(const Budget& visible);

}  // namespace reliefbench
