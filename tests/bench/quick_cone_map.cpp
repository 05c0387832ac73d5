#include "tests/bench/quick_cone_map.h"

#include <algorithm>
#include <cmath>

#include "kernels/max_pyramid.h"

namespace reliefbench {
namespace {

/// One side of a texel along one axis, at one level: the neighbour node's distance from the texel.
struct Side {
  float near2;  ///< squared distance to the node, texels
  float far2;   ///< to the part of it that the finer levels have not covered; the same where they cover none of it
  bool exists;
};

struct Axis {
  int node;
  Side low, high;
};

Axis axis(int texel, int level, int nodes) {
  const int node = texel >> level;
  const int size = 1 << level;
  const int half = size >> 1;
  // The finer level has covered a node beyond ours, on the side of its own position within ours.
  const bool covers_high = level > 0 && ((texel >> (level - 1)) & 1) != 0;
  const auto side = [&](int distance, bool is_covered, bool exists) {
    const auto near = static_cast<float>(distance);
    const auto far = static_cast<float>(is_covered ? distance + half : distance);
    return Side{.near2 = near * near, .far2 = far * far, .exists = exists};
  };
  return {.node = node,
          .low = side(texel - node * size + 1, level > 0 && !covers_high, node > 0),
          .high = side((node + 1) * size - texel, covers_high, node + 1 < nodes)};
}

}  // namespace

std::vector<float> quick_cone_map(const Heightfield& heights) {
  const MaxPyramid pyramid(heights);
  const auto& levels = pyramid.levels();
  const int side = heights.width;
  const int top_level = static_cast<int>(levels.size()) - 1;  // the root has no neighbours
  const auto side_f = static_cast<float>(side);

  // What depends on one coordinate only is worked out once.
  std::vector<Axis> axes;
  for (int texel = 0; texel < side; ++texel) {
    for (int level = 0; level < top_level; ++level) axes.push_back(axis(texel, level, side >> level));
  }

  std::vector<float> ratios;
  ratios.reserve(heights.texels.size());
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const float height = heights.at(x, y);
      float key = side_f * side_f;
      const Axis* columns = &axes[static_cast<std::size_t>(x) * static_cast<std::size_t>(top_level)];
      const Axis* rows = &axes[static_cast<std::size_t>(y) * static_cast<std::size_t>(top_level)];
      for (int level = 0; level < top_level; ++level) {
        const Axis& column = columns[level];
        const Axis& row = rows[level];
        const std::size_t stride = levels[static_cast<std::size_t>(level)].stride;
        const float* node =
            &levels[static_cast<std::size_t>(level)]
                 .nodes[static_cast<std::size_t>(row.node) * stride + static_cast<std::size_t>(column.node)];
        const auto lower = [&](float distance2, float top) {
          const float rise = top - height;
          // The division only where it lowers the key.
          if (rise > 0 && distance2 < key * (rise * rise)) key = distance2 / (rise * rise);
        };
        // A corner is an L where the finer levels cover a quarter of it: the nearer of its two arms.
        const auto corner = [](const Side& a, const Side& b) { return std::min(a.near2 + b.far2, a.far2 + b.near2); };
        if (column.low.exists) lower(column.low.far2, node[-1]);
        if (column.high.exists) lower(column.high.far2, node[1]);
        if (row.low.exists) {
          const float* above = node - stride;
          lower(row.low.far2, above[0]);
          if (column.low.exists) lower(corner(column.low, row.low), above[-1]);
          if (column.high.exists) lower(corner(column.high, row.low), above[1]);
        }
        if (row.high.exists) {
          const float* below = node + stride;
          lower(row.high.far2, below[0]);
          if (column.low.exists) lower(corner(column.low, row.high), below[-1]);
          if (column.high.exists) lower(corner(column.high, row.high), below[1]);
        }
      }
      ratios.push_back(std::min(1.0F, std::sqrt(key) / side_f));
    }
  }
  return ratios;
}

}  // namespace reliefbench
