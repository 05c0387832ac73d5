#include "tuner/cli/setting_options.h"

#include <algorithm>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "tuner/cli/options.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {

CLI::Option* add_setting_options(CLI::App& command, SettingArguments& arguments) {
  command.add_option("HEIGHTMAP", arguments.heightmap, "a file, or a name of `reliefbench list heightmaps`")
      ->required();
  CLI::Option* presets = command.add_option("--presets", arguments.presets, "presets.json; with --quality");
  CLI::Option* quality =
      command.add_option("--quality", arguments.choice.quality, "level of the presets, 0 to 100")->needs(presets);
  presets->needs(quality);
  command.add_option("--device-name", arguments.choice.device, "whose presets: glob on the device's name")
      ->type_name("GLOB")
      ->needs(presets);
  command.add_option("--case", arguments.case_id, "a case's id instead, as `recommend` and `tune` print it")
      ->type_name("ID")
      ->excludes(presets);
  command.add_option("--wrap", arguments.wrap, "repeat | clamp")
      ->check(CLI::IsMember({"repeat", "clamp"}))
      ->capture_default_str();
  command.add_option("--relief-depth", arguments.relief_depth, "in sides of one tile")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_option("--size", arguments.size, "WIDTHxHEIGHT of a procedural heightmap; default: 256x256");
  command.add_option("--seed", arguments.seed, "of a procedural heightmap")->capture_default_str();
  return presets;
}

HeightmapSpec heightmap_of(const SettingArguments& arguments) {
  HeightmapSpec spec{.source = arguments.heightmap, .seed = arguments.seed};
  if (!arguments.size.empty()) set_size(spec, arguments.size);
  return spec;
}

Wrap wrap_of(const SettingArguments& arguments) { return arguments.wrap == "clamp" ? Wrap::clamp : Wrap::repeat; }

ChosenSetting choose_setting(const SettingArguments& arguments, std::string_view command) {
  if (!arguments.case_id.empty()) return {.settings = parse_setting(arguments.case_id)};
  if (arguments.presets.empty()) fail_input("{} needs --presets with --quality, or --case", command);
  ChosenSetting result{.settings = Settings(techniques().front()),
                       .levels = parse_presets(read_file(arguments.presets), arguments.presets)};
  const LoadedPreset chosen = choose_preset(result.levels, arguments.choice, arguments.presets);
  result.settings = chosen.settings;
  std::erase_if(result.levels, [&](const LoadedPreset& preset) {
    return preset.backend != chosen.backend || preset.device != chosen.device;
  });
  std::ranges::sort(result.levels, {}, &LoadedPreset::quality);
  result.level = static_cast<int>(std::ranges::find(result.levels, chosen.quality, &LoadedPreset::quality) -
                                  result.levels.begin());
  return result;
}

}  // namespace reliefbench
