#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/maps/distance_map.h"

namespace reliefbench {

/// The node of `level` that covers node i of level 0.
inline int slow_node(int i, int side, int level) { return std::min(i >> level, level_side(side, level) - 1); }

/// The greatest level-0 value that each node of a level covers, row-major.
inline std::vector<float> slow_level(const std::vector<float>& level_0, int width, int height, int level) {
  const int columns = level_side(width, level);
  std::vector<float> nodes(static_cast<std::size_t>(columns) * static_cast<std::size_t>(level_side(height, level)), 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float& node = nodes[static_cast<std::size_t>(slow_node(y, height, level) * columns + slow_node(x, width, level))];
      node = std::max(node, level_0[static_cast<std::size_t>(y * width + x)]);
    }
  }
  return nodes;
}

/// The surface's maximum over the area of texel (x, y), from a grid of points that holds every corner of a patch.
inline double slow_highest_over(const Heightfield& heights, int x, int y, Wrap wrap) {
  const auto h = [&](int i, int j) -> double {
    return heights.at(wrapped(i, heights.width, wrap), wrapped(j, heights.height, wrap));
  };
  double highest = 0;
  for (int j = -2; j <= 2; ++j) {
    for (int i = -2; i <= 2; ++i) {
      const int a = i < 0 ? x - 1 : x;
      const int b = j < 0 ? y - 1 : y;
      const double fx = x + i * 0.25 - a;
      const double fy = y + j * 0.25 - b;
      highest = std::max(highest, (h(a, b) * (1 - fx) + h(a + 1, b) * fx) * (1 - fy) +
                                      (h(a, b + 1) * (1 - fx) + h(a + 1, b + 1) * fx) * fy);
    }
  }
  return highest;
}

/// The distance map by its definition: from each voxel's box to the box of every texel's column.
inline std::vector<double> slow_distance(const Heightfield& heights, Wrap wrap, int slices) {
  const auto gap = [&](int a, int b, int side) {
    const int d = std::abs(a - b);
    const int nearest = wrap == Wrap::repeat ? std::min(d, side - d) : d;
    return kTileSide * std::max(nearest - 1, 0) / side;
  };
  std::vector<double> highest;
  for (int y = 0; y < heights.height; ++y)
    for (int x = 0; x < heights.width; ++x) highest.push_back(slow_highest_over(heights, x, y, wrap));
  std::vector<double> values;
  for (int k = 0; k < slices; ++k) {
    for (int y = 0; y < heights.height; ++y) {
      for (int x = 0; x < heights.width; ++x) {
        double least = 1;
        for (int j = 0; j < heights.height; ++j) {
          for (int i = 0; i < heights.width; ++i) {
            const double across_u = gap(x, i, heights.width);
            const double across_v = gap(y, j, heights.height);
            const double up = std::max(
                static_cast<double>(k) / slices - highest[static_cast<std::size_t>(j * heights.width + i)], 0.0);
            least = std::min(least, across_u * across_u + across_v * across_v + up * up);
          }
        }
        values.push_back(std::sqrt(least));
      }
    }
  }
  return values;
}

}  // namespace reliefbench
