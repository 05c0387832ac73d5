#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tuner/cli/options.h"
#include "tuner/plan/preset_file.h"

namespace reliefbench {

/// One setting and the scene that it is for, as `export` and `view` take them. What is not said comes from what the
/// setting was measured in, else from the defaults.
struct SettingArguments {
  std::string heightmap{};  ///< "": that of the evidence, or of the case's id
  bool other_heightmap = false;
  std::string presets{};
  PresetChoice choice{};
  std::string case_id{};
  std::string run{};    ///< whose record the case is
  std::string tune{};   ///< folder of a tune run, whose pick it is
  std::string scene{};  ///< which of the evidence's
  std::optional<std::string> wrap{};
  std::optional<double> relief_depth{};
  std::optional<double> base{};
  std::optional<double> tiling{};
  std::optional<std::string> view{};
  std::vector<int> size_px{};  ///< width, height; empty: not said
  ReadingArguments reading{};
};

/// Adds HEIGHTMAP and the options that both commands have.
/// returns: --presets
CLI::Option* add_setting_options(CLI::App& command, SettingArguments& arguments);

/// HEIGHTMAP and the options of add_setting_options() that say such a scene, as words of a shell.
[[nodiscard]] std::string scene_words(const SceneSpec& spec);

/// What was asked for.
struct ChosenSetting {
  Settings settings;
  std::string backend{};                ///< that it was measured on; "": unknown
  std::string scene_id{};               ///< of the case's id; "": it names none
  std::vector<LoadedPreset> levels{};   ///< of the chosen device, from the cheapest; none with --case
  int level = 0;                        ///< place of the chosen one in there
  nlohmann::json evidence = nullptr;    ///< what the choice rests on; null: the user said so
  std::vector<MeasuredScene> scenes{};  ///< those of the evidence
};
/// command: its name, for messages
/// throws: Error(bad_input): neither presets nor case; no such level, device, technique, case, ...
[[nodiscard]] ChosenSetting choose_setting(const SettingArguments& arguments, std::string_view command);

}  // namespace reliefbench
