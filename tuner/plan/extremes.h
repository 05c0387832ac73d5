#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tuner/plan/case.h"

namespace reliefbench {

/// A change of settings: a parameter's id and value as text; "steps" stands for every run-time count of steps.
using SettingChange = std::pair<std::string, std::string>;

/// One extreme: where every technique, map and format is tried.
struct Extreme {
  std::string id;
  std::string about;
  SceneSpec scene;
  std::vector<SettingChange> changes{};
  bool is_large = false;  ///< takes minutes; run only when asked for
};

/// configs/extremes/*.json as read.
struct Extremes {
  std::vector<SettingChange> changes{};  ///< of all extremes, before their own
  std::vector<Extreme> list{};
};

/// throws: Error(bad_input) "FILE:LINE: key 'a.b': what was expected"
[[nodiscard]] Extremes load_extremes(const std::filesystem::path& path);
[[nodiscard]] Extremes parse_extremes(const std::string& text, const std::filesystem::path& path);
/// The extremes that the binary carries.
[[nodiscard]] Extremes built_in_extremes();
inline constexpr std::string_view kBuiltInExtremes = "standard.json";
/// Scenes drawn at random: any heightmap, size, view, depth, surface and number of steps that a config may have, with
/// the frame and the settings of the built-in extremes. Scene "SEED_I" depends on the seed and on its index alone; what
/// it is about is its text.
[[nodiscard]] Extremes random_extremes(int count, std::uint64_t seed);

/// Sets what the technique has; values of ranges are brought into them, others that it does not know are left out.
void apply(const std::vector<SettingChange>& changes, Settings& settings);

/// Every map and format of a technique that makes sense, with the changes that all extremes make and those of this one;
/// and every choice of how the map is corrected, divided, stored, read and marched on, but for large maps, whose bakes
/// take long.
[[nodiscard]] std::vector<Settings> stress_settings(const Technique& technique, const std::vector<SettingChange>& all,
                                                    const Extreme& extreme);

}  // namespace reliefbench
