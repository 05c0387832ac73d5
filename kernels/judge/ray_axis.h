#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/image/heightfield.h"

namespace reliefbench {

/// One coordinate of a ray, in cells of the padded map, and the node of 2^level cells that it is in.
struct RayAxis {
  RayAxis(double start_cell, double cells_per_t, int cell_count, Wrap wrap)
      : start(start_cell), speed(cells_per_t), cells(cell_count), forward(cells_per_t >= 0 ? 1 : 0) {
    // At rest every edge is too far ahead to reach; finite, so that 0 times it is no NaN.
    inverse = speed == 0 ? std::numeric_limits<double>::max() : 1 / speed;
    last_edge = forward * cells;
    constexpr double kNever = std::numeric_limits<double>::infinity();
    far_edge = wrap == Wrap::repeat ? last_edge : (forward != 0 ? kNever : -kNever);
  }

  /// To the cell at t, wherever that is.
  void seek(double t, Wrap wrap) {
    if (wrap == Wrap::repeat) tile = std::floor((start + speed * t) / cells) * cells;
    origin = start - tile;
    node = static_cast<int>(std::clamp(origin + speed * t, 0.0, cells - 1.0));
  }
  /// To the half of the node, of the level above, in which the ray is at t.
  void descend(int level, double t) {
    const bool past_middle = t >= (((2 * node + 1) << level) - origin) * inverse;
    node = std::min(2 * node + (past_middle ? forward : 1 - forward), (cells - 1) >> level);
  }
  /// Over the exit edge; a new tile begins where the map ends.
  void cross(int level) {
    node += 2 * forward - 1;
    if (node >= 0 && node <= (cells - 1) >> level) return;
    tile += forward != 0 ? cells : -cells;
    origin = start - tile;
    node = forward != 0 ? 0 : (cells - 1) >> level;
  }

  /// t at which the ray leaves its node.
  [[nodiscard]] double exit(int level) const {
    const int edge = std::min((node + forward) << level, cells);
    return ((edge == last_edge ? far_edge : edge) - origin) * inverse;
  }
  /// Inside the cell (level 0).
  [[nodiscard]] double fraction(double t) const { return std::clamp(origin + speed * t - node, 0.0, 1.0); }

  double start;         ///< at t = 0, in the first tile
  double speed;         ///< cells per t
  double inverse = 0;   ///< t per cell
  double tile = 0;      ///< first cell of the tile that the ray is in
  double origin = 0;    ///< start, seen from that tile
  double far_edge = 0;  ///< where the last cell ends
  int last_edge = 0;
  int cells;
  int node = 0;  ///< in the tile
  int forward;   ///< 1: towards higher cells, 0: towards lower
};

/// Texel space puts centres at whole numbers. With repeat, whole tiles are dropped; clamp counts its border cell.
inline double start_cell(double uv, int side, Wrap wrap) {
  if (wrap == Wrap::clamp) return uv * side + 0.5;
  const double tile = uv - std::floor(uv);
  const double x = tile * side - 0.5;
  return x < 0 ? x + side : x;
}

}  // namespace reliefbench
