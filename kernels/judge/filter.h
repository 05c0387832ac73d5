#pragma once
#include <vector>

namespace reliefbench {

/// A float picture of one channel, row-major.
struct Plane {
  int width = 0;
  int height = 0;
  std::vector<float> values;
  [[nodiscard]] float at(int x, int y) const {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
};

enum class Edge {
  replicate,  ///< aaa|abc|ccc
  mirror,     ///< cba|abc|cba
};

/// Separable correlation: `along_x` and `along_y` have odd lengths, their middle lies on the pixel.
[[nodiscard]] Plane filtered(const Plane& plane, const std::vector<double>& along_x, const std::vector<double>& along_y,
                             Edge edge);

/// exp(-x^2 / (2 sigma^2)) at x = -radius .. radius, in pixels, not normalised.
[[nodiscard]] std::vector<double> gaussian(double sigma, int radius);

}  // namespace reliefbench
