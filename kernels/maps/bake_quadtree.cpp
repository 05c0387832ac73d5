#include <algorithm>
#include <bit>
#include <limits>

#include "kernels/maps/pyramid_map.h"

namespace reliefbench {
namespace {

/// One level of the chain: where it begins in it, and its sides.
struct Level {
  std::size_t begin;
  int width, height;
  [[nodiscard]] std::size_t at(int x, int y) const {
    return begin + static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

}  // namespace

std::vector<float> maximum_levels(std::vector<float> level_0, int width, int height) {
  std::vector<float> values = std::move(level_0);
  const auto levels = static_cast<int>(std::bit_width(static_cast<unsigned>(std::max(width, height))));
  Level below{.begin = 0, .width = width, .height = height};
  for (int n = 1; n < levels; ++n) {
    const Level level{.begin = values.size(), .width = level_side(width, n), .height = level_side(height, n)};
    values.resize(values.size() + static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height),
                  std::numeric_limits<float>::lowest());
    for (int y = 0; y < below.height; ++y) {
      for (int x = 0; x < below.width; ++x) {
        float& parent = values[level.at(std::min(x / 2, level.width - 1), std::min(y / 2, level.height - 1))];
        parent = std::max(parent, values[below.at(x, y)]);
      }
    }
    below = level;
  }
  return values;
}

std::vector<float> bake_quadtree(const BakeRequest& request) {
  check_bakeable(request.heights);
  return maximum_levels(request.heights.texels, request.heights.width, request.heights.height);
}

}  // namespace reliefbench
