#pragma once
#include <optional>
#include <string_view>

#include "tuner/cli/setting_options.h"

namespace reliefbench {

/// The scene that a setting is drawn in or shipped for.
struct ChosenScene {
  SceneSpec spec;
  std::optional<MeasuredScene> measured{};  ///< the evidence's scene that it was taken from
  bool is_same = false;                     ///< and it is that scene, in everything
};

/// The whole scene of the evidence, or the one that the case's id names, or the defaults; what the command line says
/// besides goes before. A heightmap is read here, into `heightmaps`, as that of the evidence was read (channel,
/// inverted, ...).
/// needs_view: whether it must be known from where the relief is seen
/// command: its name, for messages
/// throws: Error(bad_input): another heightmap than the evidence's (by the heights' hash) or the id's (by name) without
///         --other-heightmap, none, an unreadable one; several scenes to choose from; an unknown scene or view
[[nodiscard]] ChosenScene choose_scene(const SettingArguments& arguments, const ChosenSetting& chosen,
                                       Heightmaps& heightmaps, bool needs_view, std::string_view command);

/// HEIGHTMAP as the command line alone has it.
[[nodiscard]] HeightmapSpec told_heightmap(const SettingArguments& arguments);

/// A line on standard error where a technique of reliefs is put on a solid.
void warn_of_holes(const Settings& settings, const HeightmapSpec& heightmap);

}  // namespace reliefbench
