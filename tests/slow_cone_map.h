#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "kernels/cone_map.h"

namespace reliefbench {

/// The cone maps by their definitions, over all pairs: what the bakers must equal, bit by bit.

/// The offset from texel to texel; under repeat to the nearest image, in (-side/2, side/2].
inline double slow_offset(int from, int to, int side, Wrap wrap) {
  int d = to - from;
  if (wrap == Wrap::repeat && 2 * d > side) d -= side;
  if (wrap == Wrap::repeat && 2 * d <= -side) d += side;
  return d;
}

/// The least key as a ratio, rounded down.
inline float slow_ratio(double key, double side) {
  const double exact = std::sqrt(key) / side;
  auto rounded = static_cast<float>(exact);
  if (static_cast<double>(rounded) > exact) rounded = std::nextafter(rounded, 0.0F);
  return rounded;
}

/// Lengths in a unit of 1/lcm(width, height) of a tile, in which every squared distance is a whole number.
struct SlowUnit {
  double x, y, tile;
  SlowUnit(int width, int height)
      : x(std::lcm(width, height) / width), y(std::lcm(width, height) / height), tile(std::lcm(width, height)) {}
};

/// correction: none or safe, safe without the 3x3 minimum
inline std::vector<float> slow_conservative(const Heightfield& heights, Wrap wrap, Correction correction) {
  const int width = heights.width;
  const int height = heights.height;
  const SlowUnit unit(width, height);
  const bool is_long = std::max(width, height) > 1.5 * std::min(width, height);
  std::vector<float> ratios;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double key = unit.tile * unit.tile;
      for (int j = 0; j < height; ++j) {
        for (int i = 0; i < width; ++i) {
          const double rise = static_cast<double>(heights.at(i, j)) - static_cast<double>(heights.at(x, y));
          if (rise <= 0) continue;
          const double dx = slow_offset(x, i, width, wrap) * unit.x;
          const double dy = slow_offset(y, j, height, wrap) * unit.y;
          double distance2 = dx * dx + dy * dy;
          if (correction == Correction::safe) {
            distance2 = is_long ? distance2 / 2 : distance2 - (unit.x * unit.x + unit.y * unit.y) / 4;
          }
          key = std::min(key, distance2 / (rise * rise));
        }
      }
      ratios.push_back(slow_ratio(key, unit.tile));
    }
  }
  return ratios;
}

/// The surface, in texel coordinates.
inline double slow_surface(const Heightfield& heights, Wrap wrap, double x, double y) {
  if (wrap == Wrap::clamp) {
    x = std::clamp(x, 0.0, heights.width - 1.0);
    y = std::clamp(y, 0.0, heights.height - 1.0);
  }
  const auto texel = [&](double i, double j) -> double {
    const auto index = [&](double k, int side) {
      const auto rest = static_cast<std::int64_t>(k) % side;
      return wrapped(static_cast<int>(rest), side, wrap);
    };
    return heights.at(index(i, heights.width), index(j, heights.height));
  };
  const double i = std::floor(x);
  const double j = std::floor(y);
  const double top = texel(i, j) + (x - i) * (texel(i + 1, j) - texel(i, j));
  const double bottom = texel(i, j + 1) + (x - i) * (texel(i + 1, j + 1) - texel(i, j + 1));
  return top + (y - j) * (bottom - top);
}

/// [PO07] listing 18-2, heights instead of depths.
inline std::vector<float> slow_relaxed_po07(const Heightfield& heights, Wrap wrap, int search_steps) {
  const int width = heights.width;
  const int height = heights.height;
  const SlowUnit unit(width, height);
  std::vector<float> ratios;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double source = heights.at(x, y);
      double least = unit.tile * unit.tile;
      for (int j = 0; j < height; ++j) {
        for (int i = 0; i < width; ++i) {
          const double target = heights.at(i, j);
          if (target <= source) continue;
          const double dx = slow_offset(x, i, width, wrap);
          const double dy = slow_offset(y, j, height, wrap);
          double z = target;
          double scale = 1;
          // A ray towards the top plate is level; it stays on its target.
          for (int step = 1; target < 1 && step <= search_steps; ++step) {
            z = target * (1 - static_cast<double>(step) / search_steps);
            scale = 1 + (target - z) * (1 / (1 - target));
            if (slow_surface(heights, wrap, x + dx * scale, y + dy * scale) < z) break;
          }
          if (z <= source) continue;
          const double distance2 = dx * unit.x * (dx * unit.x) + dy * unit.y * (dy * unit.y);
          least = std::min(least, distance2 * (scale * scale) / ((z - source) * (z - source)));
        }
      }
      ratios.push_back(slow_ratio(least, unit.tile));
    }
  }
  return ratios;
}

}  // namespace reliefbench
