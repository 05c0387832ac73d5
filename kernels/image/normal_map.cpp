#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/image/heightmap.h"
#include "kernels/image/texture_image.h"

namespace reliefbench {
namespace {

constexpr std::size_t kRgba = 4;

/// Which texels of a side a coarser one covers, at most three, and how much of each.
struct Covered {
  int first = 0;
  std::array<double, 3> share{};
};
Covered covered(int i, int fine, int coarse) {
  const double begin = 1.0 * i * fine / coarse;
  const double end = 1.0 * (i + 1) * fine / coarse;
  Covered texels{.first = static_cast<int>(begin)};
  for (int k = 0; k < 3; ++k) {
    const double low = std::max(begin, 1.0 * (texels.first + k));
    texels.share.at(static_cast<std::size_t>(k)) = std::max(std::min(end, texels.first + k + 1.0) - low, 0.0);
  }
  return texels;
}

/// The next level of an RGBA8 texture: each texel the mean of what it covers.
void append_level(std::vector<std::uint8_t>& rgba8, std::size_t from, int width, int height) {
  const int columns = level_side(width, 1);
  const int rows = level_side(height, 1);
  const std::size_t to = rgba8.size();
  rgba8.resize(to + kRgba * static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  const double area = 1.0 * width / columns * height / rows;
  parallel_for(rows, 0, [&](int y) {
    const Covered down = covered(y, height, rows);
    for (int x = 0; x < columns; ++x) {
      const Covered across = covered(x, width, columns);
      std::array<double, kRgba> sum{};
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) {
          const double share =
              down.share.at(static_cast<std::size_t>(j)) * across.share.at(static_cast<std::size_t>(i)) / area;
          if (share == 0) continue;
          const std::size_t texel = static_cast<std::size_t>(down.first + j) * static_cast<std::size_t>(width) +
                                    static_cast<std::size_t>(across.first + i);
          for (std::size_t c = 0; c < kRgba; ++c) sum.at(c) += share * rgba8[from + kRgba * texel + c];
        }
      const std::size_t texel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
      for (std::size_t c = 0; c < kRgba; ++c)
        rgba8[to + kRgba * texel + c] = static_cast<std::uint8_t>(std::lround(sum.at(c)));
    }
  });
}

}  // namespace

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

int append_levels(std::vector<std::uint8_t>& rgba8, int width, int height) {
  int levels = 1;
  for (std::size_t from = 0; width > 1 || height > 1; ++levels) {
    const std::size_t next = rgba8.size();
    append_level(rgba8, from, width, height);
    from = next;
    width = level_side(width, 1);
    height = level_side(height, 1);
  }
  return levels;
}

}  // namespace reliefbench
