#pragma once
#include <fmt/format.h>

#include <string>

#include "tuner/decide/fleet.h"

namespace reliefbench {

/// A loss of time: "3.1 % [2.2, 4.0]". An end that nothing is known of is "over 1000".
[[nodiscard]] inline std::string time_loss_text(const Loss& loss) {
  constexpr double kMostTold = 10;
  const std::string high = loss.high > kMostTold ? "over 1000" : fmt::format("{:.1f}", 100 * loss.high);
  return fmt::format("{:.1f} % [{:.1f}, {}]", 100 * loss.value, 100 * loss.low, high);
}

}  // namespace reliefbench
