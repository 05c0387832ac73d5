#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/plan/config.h"

namespace reliefbench {

struct Plan {
  std::vector<Case> cases;             ///< no duplicates; sorted by backend, scene, bake, then settings
  std::vector<std::string> bakes;      ///< distinct bake_text()s
  std::vector<std::string> conflicts;  ///< combinations left out because they make no sense, with the reason
};

/// Expands the config for some backends. filter: a glob (`*`, `?`) on case ids; key: setting_key(); "" = all.
/// throws: Error(bad_input): nothing is left; a sweep whose every combination is left out (with its line)
[[nodiscard]] Plan make_plan(const Config& config, std::span<const std::string> backend_ids, std::string_view filter,
                             std::string_view key = "");

/// Whether any of a sweep's combinations is a setting that makes sense.
[[nodiscard]] bool has_settings(const SweepSpec& sweep, const std::filesystem::path& path);

[[nodiscard]] bool glob_matches(std::string_view pattern, std::string_view text);

}  // namespace reliefbench
