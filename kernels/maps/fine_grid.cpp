#include "kernels/maps/fine_grid.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/rounding.h"

namespace reliefbench {

Subdivision subdivision(int width, int height, int k) {
  if (k == 1) return {};
  const double aspect = static_cast<double>(width) / height;
  return {.x = k * std::max(1, static_cast<int>(std::lround(1 / aspect))),
          .y = k * std::max(1, static_cast<int>(std::lround(aspect)))};
}

bool is_affordable(int width, int height, Subdivision by) {
  if (by == Subdivision{}) return true;
  const auto fits = [](int side, int factor) { return static_cast<long long>(side) * factor <= kMaxFineSide; };
  return fits(width, by.x) && fits(height, by.y);
}

Heightfield refine(const Heightfield& heights, Wrap wrap, Subdivision by) {
  if (by == Subdivision{}) return heights;
  Heightfield fine{
      .width = fine_side(heights.width, by.x, wrap), .height = fine_side(heights.height, by.y, wrap), .texels = {}};
  fine.texels.reserve(static_cast<std::size_t>(fine.width) * static_cast<std::size_t>(fine.height));
  for (int j = 0; j < fine.height; ++j) {
    const int low = j / by.y;
    const int high = wrapped(low + 1, heights.height, wrap);
    const double fy = static_cast<double>(j % by.y) / by.y;
    for (int i = 0; i < fine.width; ++i) {
      const int left = i / by.x;
      const int right = wrapped(left + 1, heights.width, wrap);
      const double fx = static_cast<double>(i % by.x) / by.x;
      const double bottom = heights.at(left, low) * (1 - fx) + heights.at(right, low) * fx;
      const double top = heights.at(left, high) * (1 - fx) + heights.at(right, high) * fx;
      fine.texels.push_back(rounded_down(bottom * (1 - fy) + top * fy));
    }
  }
  return fine;
}

}  // namespace reliefbench
