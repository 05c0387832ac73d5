#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tuner/decide/presets.h"

namespace reliefbench {

/// One heightmap and one setting for it, as `export` and `view` take them.
struct SettingArguments {
  std::string heightmap;
  std::string presets;
  PresetChoice choice;
  std::string case_id;
  std::string wrap = "repeat";
  double relief_depth = Scene{}.relief_depth;
  std::string size;
  std::uint32_t seed = 1;
};

/// Adds HEIGHTMAP and the options of all members but choice.backend; `arguments` must outlive the parse.
/// returns: --presets
CLI::Option* add_setting_options(CLI::App& command, SettingArguments& arguments);

[[nodiscard]] HeightmapSpec heightmap_of(const SettingArguments& arguments);  ///< throws: Error(bad_input)
[[nodiscard]] Wrap wrap_of(const SettingArguments& arguments);

/// What was asked for.
struct ChosenSetting {
  Settings settings;
  std::vector<LoadedPreset> levels{};  ///< of the chosen device, from the cheapest; none with --case
  int level = 0;                       ///< place of the chosen one in there
};
/// command: its name, for messages
/// throws: Error(bad_input): neither presets nor case; no such level, device, technique, ...
[[nodiscard]] ChosenSetting choose_setting(const SettingArguments& arguments, std::string_view command);

}  // namespace reliefbench
