#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/maps/cone_bounds.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"
#include "kernels/maps/sector_map.h"

namespace reliefbench {
namespace {

constexpr int kPerTexel = 4;               // points a texel of the bounds
constexpr double kRounding = 1 - 0x1p-40;  // over the rounding of sums in double

/// The points of a finer grid that a texel's ratio has weight at, along one axis.
struct Support {
  struct Point {
    int index;
    double weight;
  };
  std::vector<Point> points;
};

std::vector<Support> supports(int side, int by, Wrap wrap) {
  std::vector<Support> all(static_cast<std::size_t>(side));
  const int count = fine_side(side, by, wrap);
  for (int texel = 0; texel < side; ++texel) {
    for (int offset = 1 - by; offset < by; ++offset) {
      const int point = texel * by + offset;
      if (wrap == Wrap::clamp && (point < 0 || point >= count)) continue;
      all[static_cast<std::size_t>(texel)].points.push_back(
          {.index = wrapped(point, count, wrap), .weight = 1 - static_cast<double>(std::abs(offset)) / by});
    }
  }
  return all;
}

/// Raises texels' ratios as far as a bound at every point of a finer grid allows.
class Raising {
 public:
  Raising(const Heightfield& heights, Wrap wrap, Subdivision by, const FineRatios& limits)
      : columns_(supports(heights.width, by.x, wrap)),
        rows_(supports(heights.height, by.y, wrap)),
        width_(limits.width),
        limits_(limits.ratios.begin(), limits.ratios.end()),
        ratios_(heights.texels.size(), 0) {
    for (double& limit : limits_) limit *= kRounding;
    room_ = limits_;
    // The least limit of its points is safe for every texel together. Then one pass is enough: whatever is raised after
    // a texel only leaves that texel less room.
    raise_all([](double limit, double /*room*/, double /*weight*/) { return limit; });
    raise_all([](double /*limit*/, double room, double weight) { return room / weight; });
  }

  [[nodiscard]] const std::vector<double>& ratios() const { return ratios_; }

 private:
  /// Raises each texel by the least that `rise_at` allows over its points.
  template <typename RiseAt>
  void raise_all(const RiseAt& rise_at) {
    for (std::size_t i = 0; i < ratios_.size(); ++i) {
      double rise = std::numeric_limits<double>::max();
      for_each_point(i, [&](std::size_t point, double weight) {
        rise = std::min(rise, rise_at(limits_[point], room_[point], weight));
      });
      if (rise > 0) raise(i, rise);
    }
  }

  void raise(std::size_t texel, double rise) {
    ratios_[texel] += rise;
    for_each_point(texel, [&](std::size_t point, double weight) { room_[point] -= weight * rise; });
  }

  template <typename Body>
  void for_each_point(std::size_t texel, const Body& body) const {
    for (const auto& [row, weight_y] : rows_[texel / columns_.size()].points)
      for (const auto& [column, weight_x] : columns_[texel % columns_.size()].points)
        body(static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column),
             weight_x * weight_y);
  }

  std::vector<Support> columns_;
  std::vector<Support> rows_;
  int width_;
  std::vector<double> limits_;
  std::vector<double> ratios_;
  std::vector<double> room_;  ///< limit minus interpolated ratio
};

/// The least bound of the cells round each point.
FineRatios limits_at_points(const FineRatios& cells, Wrap wrap) {
  const int border = wrap == Wrap::clamp ? 1 : 0;
  FineRatios points{.width = cells.width + border, .height = cells.height + border, .ratios = {}};
  points.ratios.reserve(static_cast<std::size_t>(points.width) * static_cast<std::size_t>(points.height));
  for (int j = 0; j < points.height; ++j) {
    const int below = wrapped(j - 1, cells.height, wrap);
    const int row = wrapped(j, cells.height, wrap);
    for (int i = 0; i < points.width; ++i) {
      const int left = wrapped(i - 1, cells.width, wrap);
      const int column = wrapped(i, cells.width, wrap);
      points.ratios.push_back(
          std::min({cells.at(left, below), cells.at(column, below), cells.at(left, row), cells.at(column, row)}));
    }
  }
  return points;
}

}  // namespace

std::vector<float> certified_cones(const BakeRequest& request) { return certified_cones(request, std::nullopt); }

std::vector<float> certified_cones(const BakeRequest& request, const std::optional<Wedge>& wedge) {
  const Heightfield& heights = request.heights;
  int k = kPerTexel;
  while (!is_affordable(heights.width, heights.height, subdivision(heights.width, heights.height, k))) k /= 2;
  const Subdivision by = subdivision(heights.width, heights.height, k);
  BoundRequest bounds{.heights = heights,
                      .wrap = request.wrap,
                      .max_ratio = request.max_ratio,
                      .wedge = wedge,
                      .threads = request.threads};
  const FineRatios of_cells = lower_cone_bounds(bounds);
  bounds.by = by;
  FineRatios of_fine_cells = lower_cone_bounds(bounds);
  keep_coarser(of_fine_cells, of_cells);
  const FineRatios limits = limits_at_points(of_fine_cells, request.wrap);
  const Raising raising(heights, request.wrap, by, limits);
  std::vector<float> ratios;
  ratios.reserve(heights.texels.size());
  for (const double ratio : raising.ratios()) ratios.push_back(rounded_down(ratio));
  return ratios;
}

}  // namespace reliefbench
