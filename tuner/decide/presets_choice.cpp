#include <fmt/format.h>

#include <set>

#include "kernels/base/error.h"
#include "tuner/decide/presets.h"
#include "tuner/plan/plan.h"

namespace reliefbench {
namespace {

std::string device_text(const LoadedPreset& preset) { return fmt::format("{} ({})", preset.backend, preset.device); }

std::string joined(const std::set<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

}  // namespace

const LoadedPreset& choose_preset(std::span<const LoadedPreset> presets, const PresetChoice& choice,
                                  std::string_view file) {
  const LoadedPreset* found = nullptr;
  std::set<std::string> all;
  std::set<std::string> meant;
  std::set<int> levels;
  for (const LoadedPreset& preset : presets) {
    all.insert(device_text(preset));
    if (!choice.backend.empty() && preset.backend != choice.backend) continue;
    if (!choice.device.empty() && !glob_matches(choice.device, preset.device)) continue;
    meant.insert(device_text(preset));
    levels.insert(preset.quality);
    if (preset.quality <= choice.quality && (found == nullptr || found->quality < preset.quality)) found = &preset;
  }
  if (meant.empty())
    fail_input("{}: no device '{}' of backend '{}' (it has {})", file, choice.device.empty() ? "*" : choice.device,
               choice.backend.empty() ? "*" : choice.backend, joined(all));
  if (meant.size() > 1)
    fail_input("{}: holds {} devices, choose one by --backend and --device-name: {}", file, meant.size(),
               joined(meant));
  if (found == nullptr || choice.quality > kBestPreset)
    fail_input("{}: there is no level {}; it has {}, and what is between two is the lower", file, choice.quality,
               fmt::join(levels, ", "));
  return *found;
}

}  // namespace reliefbench
