#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <span>

#include "tuner/results/store.h"

namespace reliefbench {

inline constexpr std::size_t kFleetSettings = 12;  ///< that a page lists
/// A page's `fleet` of what `choose --json` or tune.json tells: with the names that people read.
[[nodiscard]] nlohmann::json fleet_page_data(nlohmann::json told);
/// What `choose` would say of all runs; null where there is one place only.
[[nodiscard]] nlohmann::json fleet_of(std::span<const Run> runs);

}  // namespace reliefbench
