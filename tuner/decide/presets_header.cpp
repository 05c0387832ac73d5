#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "tuner/decide/presets.h"
#include "tuner/plan/registry_params.h"
#include "tuner/results/case_table.h"

namespace reliefbench {
namespace {

/// Letters, digits and single underscores: GLSL keeps names with two in a row for itself.
std::string macro_name(std::string_view text) {
  std::string name;
  for (const char c : text) {
    const bool is_digit = c >= '0' && c <= '9';
    const bool is_lower = c >= 'a' && c <= 'z';
    const bool is_upper = c >= 'A' && c <= 'Z';
    if (is_lower) name += static_cast<char>(c - 'a' + 'A');
    if (is_digit || is_upper) name += c;
    if (!is_digit && !is_lower && !is_upper && !name.empty() && name.back() != '_') name += '_';
  }
  while (name.ends_with('_')) name.pop_back();
  return name;
}

/// Text for a `//` comment: printable, and no backslash that would draw in the next line.
std::string comment(std::string_view text) {
  std::string safe(text);
  std::ranges::replace_if(
      safe, [](char c) { return c < ' ' || c > '~' || c == '\\'; }, '?');
  return fmt::format("// {}\n", safe);
}

std::string define(const std::string& name, const std::string& value) {
  return fmt::format("#define {} {}\n", name, value);
}

/// "RELIEF_MAP_QUICK"
std::string value_name(std::string_view param, std::string_view value) {
  return fmt::format("RELIEF_{}_{}", macro_name(param), macro_name(value));
}

/// Numbers of the techniques, and of every named value of the parameters that the levels use.
std::string constants(const std::set<std::string_view>& used) {
  std::string text = comment("Techniques, and the named values of their parameters.");
  for (std::size_t i = 0; i < techniques().size(); ++i)
    text += define(value_name("technique", techniques()[i].id), fmt::format("{}", i));
  for (const RegistryParam& param : registry_params())
    for (std::size_t i = 0; used.contains(param.id) && i < param.values.size(); ++i)
      text += define(value_name(param.id, param.values[i]), fmt::format("{}", i));
  return text;
}

std::string level_text(const std::string& prefix, int quality, const PresetLevel& level, const Presets& presets) {
  const Record& record = *level.evidence.front().record;
  const Settings settings = settings_of(record.technique, record.params);
  std::string text =
      comment(fmt::format("{} of quality: {:.3g} times the fastest, {} {:.3g}; {}{}", quality, level.relative_time,
                          presets.error_metric, level.error, record.case_id, coarse_mark(level)));
  const std::string own = fmt::format("{}_Q{}", prefix, quality);
  text += define(own + "_TECHNIQUE", value_name("technique", record.technique));
  for (const SettingValue& given : settings.values()) {
    const Param& param = given.param;
    text += define(fmt::format("{}_{}", own, macro_name(param.id)),
                   param.choices.empty() ? given.text() : value_name(param.id, given.text()));
  }
  return text;
}

}  // namespace

std::string presets_header(const Presets& presets) {
  std::set<std::string_view> used;
  for (const DevicePresets& device : presets.devices)
    for (const PresetLevel& level : device.levels)
      for (const auto& [id, ignored] : level.evidence.front().record->params) used.insert(id);

  std::string text = comment("Quality levels of relief mapping, for C++ and GLSL. Made by `reliefbench presets`.");
  for (const std::string& note : coarse_notes(presets)) text += comment(note);
  text += "#ifndef RELIEF_PRESETS_H\n#define RELIEF_PRESETS_H\n\n";
  text += constants(used);
  std::set<std::string> prefixes;
  for (const DevicePresets& device : presets.devices) {
    const std::string name = value_name(device.backend, device.device);
    std::string prefix = name;
    for (int i = 2; !prefixes.insert(prefix).second; ++i) prefix = fmt::format("{}_{}", name, i);
    text += "\n";
    text += comment(fmt::format("{}, {}, driver {}", device.backend, device.device, device.driver));
    auto level = device.levels.begin();
    for (int quality = 0; quality <= kBestPreset; quality += kPresetStep) {
      if (std::next(level) != device.levels.end() && std::next(level)->quality <= quality) ++level;
      text += level_text(prefix, quality, *level, presets);
    }
  }
  return text + "\n#endif\n";
}

}  // namespace reliefbench
