#pragma once
#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>
#include <vector>

#include "tuner/decide/presets.h"

namespace reliefbench {

/// What a level is, before it is told of a device or of a fleet.
template <typename Setting>
struct LevelSetting {
  int quality = 0;
  Setting setting;
};

/// The level errors between which levels are spaced.
struct LevelRange {
  double loosest = 0;  ///< of the cheapest setting
  double least = 0;
};

/// The levels from the cheapest to the best, found from the best down. Of levels of one setting the lowest stays.
/// pick: (level_limit(), the setting of the level above or null) -> the setting
/// is_same: of two settings
template <typename Setting, typename Pick, typename IsSame>
std::vector<LevelSetting<Setting>> levels_of(const LevelRange& range, const Presets& presets, Pick pick,
                                             IsSame is_same) {
  std::vector<LevelSetting<Setting>> levels;
  for (int quality = kBestPreset; quality >= 0; quality -= kPresetStep) {
    const Setting* const above = levels.empty() ? nullptr : &levels.back().setting;
    Setting picked = pick(level_limit(range.loosest, range.least, quality, presets), above);
    if (above != nullptr && is_same(picked, *above)) levels.pop_back();
    levels.push_back({.quality = quality, .setting = std::move(picked)});
  }
  std::ranges::reverse(levels);
  return levels;
}

/// Adds a warning where there are few levels.
/// what: has them, "vulkan, GPU"; settings: within the constraints
void warn_of_few_levels(Presets& presets, std::string_view what, std::size_t levels, std::size_t settings);

}  // namespace reliefbench
