#include <cmath>

#include "kernels/image/heightmap.h"

namespace reliefbench {

std::vector<std::uint8_t> normal_map(const Heightfield& heights, Wrap wrap, double relief_depth) {
  const auto byte = [](double component) {
    return static_cast<std::uint8_t>(std::lround((component * 0.5 + 0.5) * 255.0));
  };
  std::vector<std::uint8_t> rgba8;
  rgba8.reserve(heights.texels.size() * 4);
  for (int y = 0; y < heights.height; ++y) {
    for (int x = 0; x < heights.width; ++x) {
      const auto h = [&](int dx, int dy) {
        return double{heights.at(wrapped(x + dx, heights.width, wrap), wrapped(y + dy, heights.height, wrap))};
      };
      // Slopes in tiles of depth per tile of uv, over two texels.
      const double slope_u = relief_depth * (h(1, 0) - h(-1, 0)) * heights.width / 2;
      const double slope_v = relief_depth * (h(0, 1) - h(0, -1)) * heights.height / 2;
      const double length = std::sqrt(slope_u * slope_u + slope_v * slope_v + 1);
      rgba8.insert(rgba8.end(), {byte(-slope_u / length), byte(-slope_v / length), byte(1 / length), 255});
    }
  }
  return rgba8;
}

}  // namespace reliefbench
