#pragma once
#include <array>
#include <charconv>
#include <cmath>

namespace reliefbench {

/// The greatest float that is not above `value`. value: >= 0
[[nodiscard]] inline float rounded_down(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) > value ? std::nextafter(nearest, 0.0F) : nearest;
}

/// The double nearest to the value with so many decimal digits, in every locale; the value itself where no double is
/// as great. digits: 1 to 17
[[nodiscard]] inline double rounded_to_digits(double value, int digits) {
  std::array<char, 32> text{};
  const char* const end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, digits).ptr;
  std::from_chars(text.data(), end, value);
  return value;
}

}  // namespace reliefbench
