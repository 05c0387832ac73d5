#pragma once
#include <tuple>

namespace reliefbench {

/// Of a frame or a window, in pixels, or of a map, in texels.
struct Size {
  int width = 0;
  int height = 0;
  bool operator==(const Size&) const = default;
  bool operator<(const Size& other) const { return std::tie(width, height) < std::tie(other.width, other.height); }
};

}  // namespace reliefbench
