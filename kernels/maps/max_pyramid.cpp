#include "kernels/maps/max_pyramid.h"

#include <algorithm>

namespace reliefbench {
namespace {

MaxPyramid::Level empty_level(std::size_t width, std::size_t height) {
  const std::size_t stride = width + width % 2;
  return {.stride = stride, .nodes = std::vector<float>(stride * (height + height % 2), MaxPyramid::kNothing)};
}

}  // namespace

MaxPyramid::MaxPyramid(const Heightfield& heights) {
  auto width = static_cast<std::size_t>(heights.width);
  auto height = static_cast<std::size_t>(heights.height);
  levels_.push_back(empty_level(width, height));
  for (std::size_t y = 0; y < height; ++y) {
    std::copy_n(heights.texels.data() + y * width, width, levels_[0].nodes.data() + y * levels_[0].stride);
  }
  while (width > 1 || height > 1) {
    width = (width + 1) / 2;
    height = (height + 1) / 2;
    Level level = empty_level(width, height);
    const Level& below = levels_.back();
    for (std::size_t y = 0; y < height; ++y) {
      for (std::size_t x = 0; x < width; ++x) {
        level.nodes[y * level.stride + x] =
            std::max(std::max(below.at(2 * x, 2 * y), below.at(2 * x + 1, 2 * y)),
                     std::max(below.at(2 * x, 2 * y + 1), below.at(2 * x + 1, 2 * y + 1)));
      }
    }
    levels_.push_back(std::move(level));
  }
}

}  // namespace reliefbench
