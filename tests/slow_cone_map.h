#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "kernels/maps/cone_map.h"

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

/// The squared distance of an offset in texels, in SlowUnit.
struct SlowMetric {
  SlowUnit unit;
  bool is_safe, is_long;
  SlowMetric(const Heightfield& heights, Correction correction)
      : unit(heights.width, heights.height),
        is_safe(correction == Correction::safe),
        is_long(std::max(heights.width, heights.height) > 1.5 * std::min(heights.width, heights.height)) {}
  [[nodiscard]] double distance2(double dx, double dy) const {
    const double exact = dx * unit.x * (dx * unit.x) + dy * unit.y * (dy * unit.y);
    if (!is_safe) return exact;
    return is_long ? exact / 2 : exact - (unit.x * unit.x + unit.y * unit.y) / 4;
  }
};

/// correction: none or safe, safe without the 3x3 minimum
inline std::vector<float> slow_conservative(const Heightfield& heights, Wrap wrap, Correction correction,
                                            float max_ratio = 1) {
  const int width = heights.width;
  const int height = heights.height;
  const SlowMetric metric(heights, correction);
  const double widest = metric.unit.tile * static_cast<double>(max_ratio);
  std::vector<float> ratios;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double key = widest * widest;
      for (int j = 0; j < height; ++j) {
        for (int i = 0; i < width; ++i) {
          const double rise = static_cast<double>(heights.at(i, j)) - static_cast<double>(heights.at(x, y));
          if (rise <= 0) continue;
          const double distance2 = metric.distance2(slow_offset(x, i, width, wrap), slow_offset(y, j, height, wrap));
          key = std::min(key, distance2 / (rise * rise));
        }
      }
      ratios.push_back(slow_ratio(key, metric.unit.tile));
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

/// Whether a target counts: of a texel of the map, at an offset in texels (to one of its images).
using SlowView = std::function<bool(int i, int j, double dx, double dy)>;

/// The least ratio over the targets that count; under repeat over all their images up to `tiles` tiles away.
/// correction: none or safe, safe without the 3x3 minimum
inline std::vector<float> slow_view_ratios(const BakeRequest& request, int tiles, const SlowView& counts) {
  const Heightfield& heights = request.heights;
  const SlowMetric metric(heights, request.correction);
  const double widest = metric.unit.tile * static_cast<double>(request.max_ratio);
  if (request.wrap == Wrap::clamp) tiles = 0;
  std::vector<float> ratios;
  for (int y = 0; y < heights.height; ++y) {
    for (int x = 0; x < heights.width; ++x) {
      double key = widest * widest;
      for (int j = 0; j < heights.height; ++j) {
        for (int i = 0; i < heights.width; ++i) {
          const double rise = static_cast<double>(heights.at(i, j)) - static_cast<double>(heights.at(x, y));
          if (rise <= 0) continue;
          for (int tile = 0; tile < (2 * tiles + 1) * (2 * tiles + 1); ++tile) {
            const double dx = i - x + (tile % (2 * tiles + 1) - tiles) * heights.width;
            const double dy = j - y + (tile / (2 * tiles + 1) - tiles) * heights.height;
            const double found = metric.distance2(dx, dy) / (rise * rise);
            if (found < key && counts(i, j, dx, dy)) key = found;
          }
        }
      }
      ratios.push_back(slow_ratio(key, metric.unit.tile));
    }
  }
  return ratios;
}

/// [BVBV24] algorithm 2: a target counts in a quadrant where its cell there goes down along an edge.
inline std::vector<float> slow_relaxed(const BakeRequest& request) {
  const auto at = [&](int i, int j) {
    return request.heights.at(wrapped(i, request.heights.width, request.wrap),
                              wrapped(j, request.heights.height, request.wrap));
  };
  return slow_view_ratios(request, 1, [&](int k, int l, double dx, double dy) {
    for (const int x : {-1, 1}) {
      for (const int y : {-1, 1}) {
        if (dx * x < 0 || dy * y < 0) continue;
        if (at(k, l) > at(k + x, l) || at(k, l) > at(k, l + y) || at(k + x, l) > at(k + x, l + y) ||
            at(k, l + y) > at(k + x, l + y)) {
          return true;
        }
      }
    }
    return false;
  });
}

/// Cones of the sector of 90 degrees round the axis (x, y); `safe`: with an offset less than one texel from one in the
/// sector. Under clamp owners on the border behind them, and targets on the one before them, see all that is ahead.
inline std::vector<float> slow_sector(const BakeRequest& request, int x, int y) {
  const double u = 1.0 / request.heights.width;
  const double v = 1.0 / request.heights.height;
  const double margin = request.correction == Correction::safe ? 1 - 1e-9 : 0;
  const int last = x != 0 ? request.heights.width - 1 : request.heights.height - 1;
  const int before = x + y > 0 ? last : 0;
  return slow_view_ratios(request, 2, [&](int i, int j, double dx, double dy) {
    const double ahead = dx * x + dy * y;
    const double target = x != 0 ? i : j;
    const double owner = target - (x != 0 ? dx : dy);
    const bool is_beside = target == before || owner == last - before;
    if (request.wrap == Wrap::clamp && is_beside && ahead >= 0) return true;
    // The corner of the square round the offset that is deepest in the sector.
    const double along = x != 0 ? dx * x + margin : dy * y + margin;
    const double across = std::max(std::abs(x != 0 ? dy : dx) - margin, 0.0);
    return along * (x != 0 ? u : v) * (1 + 1e-12) >= across * (x != 0 ? v : u);
  });
}

/// Pairs of points on the interpolated surface of which one lies inside the other's interpolated cone for its
/// direction; under clamp also of points beside the map.
/// cones: the ratios of each sector of directions, none over 1. sector_of(du, dv): whose one is looked at
template <typename SectorOf>
int surface_points_in_sectors(const Heightfield& map, const std::vector<Heightfield>& cones, Wrap wrap,
                              const SectorOf& sector_of) {
  constexpr int kPerTexel = 3;
  const int tiles = wrap == Wrap::repeat ? 1 : 0;
  const int beside = wrap == Wrap::clamp ? 4 : 0;
  struct SurfacePoint {
    double u, v, z;
    std::array<double, 16> ratios;
  };
  std::vector<SurfacePoint> points;
  for (int j = -beside * kPerTexel; j < (map.height + beside) * kPerTexel; j += j < 0 || j >= map.height * 3 ? 3 : 1) {
    for (int i = -beside * kPerTexel; i < (map.width + beside) * kPerTexel; i += i < 0 || i >= map.width * 3 ? 3 : 1) {
      const double x = static_cast<double>(i) / kPerTexel - 0.5;
      const double y = static_cast<double>(j) / kPerTexel - 0.5;
      SurfacePoint point{.u = x / map.width, .v = y / map.height, .z = slow_surface(map, wrap, x, y), .ratios = {}};
      for (std::size_t k = 0; k < cones.size(); ++k) point.ratios.at(k) = slow_surface(cones[k], wrap, x, y);
      points.push_back(point);
    }
  }
  const auto is_inside = [&](const SurfacePoint& p, double rise, double du, double dv) {
    const double distance = std::hypot(du, dv);
    if (distance >= rise) return false;
    const auto k = static_cast<std::size_t>(sector_of(du, dv));
    return distance < p.ratios.at(k) * rise * (1 - 1e-9) - 1e-9;
  };
  int inside = 0;
  for (const SurfacePoint& p : points)
    for (const SurfacePoint& q : points) {
      if (q.z - p.z <= 1e-9) continue;
      for (int j = -tiles; j <= tiles; ++j)
        for (int i = -tiles; i <= tiles; ++i) inside += is_inside(p, q.z - p.z, q.u - p.u + i, q.v - p.v + j) ? 1 : 0;
    }
  return inside;
}

/// The radius, at most 1 uv, of the largest disc round a texel (or a point at the edge of a clamped map) in which no
/// ray that goes down and starts over its surface point can leave the surface, cell by cell, as bake_safety_shape
/// decides it. floor: where it need not stay in sight, the surface must rise from this height on
inline float slow_radius(const Heightfield& heights, Wrap wrap, double x, double y, double floor) {
  const SlowMetric metric(heights, Correction::none);
  const int tiles = wrap == Wrap::repeat ? 1 : 0;
  const int border = 1 - tiles;
  const double height = slow_surface(heights, wrap, x, y);
  double key = metric.unit.tile * metric.unit.tile;
  for (int l = -border - tiles * heights.height; l < heights.height * (1 + tiles); ++l) {
    for (int k = -border - tiles * heights.width; k < heights.width * (1 + tiles); ++k) {
      const auto at = [&](int i, int j) -> double {
        return heights.at(wrapped(k + i, heights.width, wrap), wrapped(l + j, heights.height, wrap));
      };
      bool is_harmless_as_rising = true;
      bool is_harmless_in_sight = true;
      for (const int j : {0, 1}) {
        for (const int i : {0, 1}) {
          const double climb = (k + i - x) * (at(1, j) - at(0, j)) + (l + j - y) * (at(i, 1) - at(i, 0));
          is_harmless_as_rising = is_harmless_as_rising && climb >= 0 && at(i, j) >= floor;
          is_harmless_in_sight = is_harmless_in_sight && climb - at(i, j) + height >= 0;
        }
      }
      const bool is_flat = at(0, 0) == at(1, 0) && at(0, 0) == at(0, 1) && at(0, 0) == at(1, 1);
      if (is_harmless_as_rising || is_harmless_in_sight || is_flat) continue;
      const auto gap = [](double from, int to) { return std::max({to - from, from - to - 1, 0.0}); };
      key = std::min(key, metric.distance2(gap(x, k), gap(y, l)));
    }
  }
  return slow_ratio(key, metric.unit.tile);
}

/// [VB22] as its pseudo-code has it, with sets of texels; which: 1 or 2, the algorithm.
/// correction: none or safe, safe without the 3x3 minimum
inline std::vector<float> slow_quick(const BakeRequest& request, int which) {
  const Heightfield& heights = request.heights;
  const int width = heights.width;
  const int height = heights.height;
  const SlowMetric metric(heights, request.correction);
  const double widest = metric.unit.tile * static_cast<double>(request.max_ratio);
  using Texel = std::pair<int, int>;
  std::vector<float> ratios;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double h = heights.at(x, y);
      double key = widest * widest;
      std::set<Texel> visited{{x, y}};
      for (int level = 0; (std::max(width, height) - 1) >> level > 0; ++level) {
        const int columns = ((width - 1) >> level) + 1;
        const int rows = ((height - 1) >> level) + 1;
        std::set<Texel> neighbours;
        for (const int j : {-1, 0, 1}) {
          for (const int i : {-1, 0, 1}) {
            const Texel node{wrapped((x >> level) + i, columns, request.wrap),
                             wrapped((y >> level) + j, rows, request.wrap)};
            if (node != Texel{x >> level, y >> level}) neighbours.insert(node);
          }
        }
        for (const Texel& node : neighbours) {
          std::vector<Texel> footprint;
          for (int j = node.second << level; j < std::min(height, (node.second + 1) << level); ++j) {
            for (int i = node.first << level; i < std::min(width, (node.first + 1) << level); ++i) {
              footprint.emplace_back(i, j);
            }
          }
          double top = -1;
          double distance2 = std::numeric_limits<double>::infinity();
          for (const auto& [i, j] : footprint) {
            top = std::max(top, static_cast<double>(heights.at(i, j)));
            if (which == 2 && visited.contains({i, j})) continue;
            distance2 = std::min(distance2, metric.distance2(slow_offset(x, i, width, request.wrap),
                                                             slow_offset(y, j, height, request.wrap)));
          }
          visited.insert(footprint.begin(), footprint.end());
          if (top > h) key = std::min(key, distance2 / ((top - h) * (top - h)));
        }
      }
      ratios.push_back(slow_ratio(key, metric.unit.tile));
    }
  }
  return ratios;
}

}  // namespace reliefbench
