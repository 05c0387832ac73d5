#pragma once
#include <cmath>

namespace reliefbench {

/// The greatest float that is not above `value`. value: >= 0
[[nodiscard]] inline float rounded_down(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) > value ? std::nextafter(nearest, 0.0F) : nearest;
}

}  // namespace reliefbench
