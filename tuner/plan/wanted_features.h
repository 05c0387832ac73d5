#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "kernels/trace/technique.h"

namespace reliefbench {

/// The name of what every scene may do without first: hits that are not the plane's own.
inline constexpr std::string_view kDisplacement = "displacement";

/// A feature that settings are to show, by any of some rows.
struct WantedFeature {
  const Feature* feature = nullptr;       ///< null: displacement itself
  std::vector<const FeatureRow*> rows{};  ///< not the plainest
};

/// "shadow,penumbra", "shadow=soft_cone", the names that `require` answers with: a feature of the scene by any row,
/// what rows bring besides, one row, or "displacement". What is said twice of one feature must hold at once.
/// throws: Error(bad_input): no such feature or row, nothing is both
[[nodiscard]] std::vector<WantedFeature> parse_wanted_features(std::string_view text);

/// Whether frames with these settings show all of it.
[[nodiscard]] bool shows(const Settings& settings, std::span<const WantedFeature> wanted);

}  // namespace reliefbench
