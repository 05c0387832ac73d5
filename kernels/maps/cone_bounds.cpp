#include "kernels/maps/cone_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/maps/cone_search.h"
#include "kernels/maps/sector_map.h"

namespace reliefbench {
namespace {

constexpr double kRiseError = 0x1p-24 * (1 + 1e-6);  // of two heights rounded down to float, and of the doubles before

struct Search {
  FineRatios found;
  float max_ratio = 0;  ///< as searched
  double guard = 0;     ///< rise_guard
};

Search search(const BoundRequest& request, Correction correction) {
  check_bakeable(request.heights);
  const auto [by_x, by_y] = request.by;
  const Heightfield fine = refine(request.heights, request.wrap, request.by);
  // Of the whole torus, though a clamped grid has fewer points: uv are of the original tile.
  const int width = request.heights.width * by_x;
  const int height = request.heights.height * by_y;
  const ConeMetric metric = cone_metric(width, height, correction);
  const float max_ratio = request.max_ratio * kBoundsBeyond;
  const ConeSearch points{
      .heights = fine, .wrap = request.wrap, .metric = metric, .max_ratio = max_ratio, .threads = request.threads};
  std::vector<float> ratios;
  if (!request.wedge) {
    ratios = search_cones(points);
  } else if (correction == Correction::safe) {
    ratios = search_wedge(points, fine, width, height, *request.wedge, request.wedge->safe_margin);
  } else {
    ConeSearch seen = points;
    seen.views = {wedge_view(fine, width, height, *request.wedge, 0)};
    ratios = search_cones(seen);
  }
  return {.found = {.width = fine.width, .height = fine.height, .ratios = std::move(ratios)},
          .max_ratio = max_ratio,
          .guard = rise_guard(request.heights, request.by, correction)};
}

}  // namespace

float rise_guard(const Heightfield& heights, Subdivision by, Correction correction) {
  if (by == Subdivision{}) return 0;
  const ConeMetric metric = cone_metric(heights.width * by.x, heights.height * by.y, correction);
  const double nearest = std::sqrt(std::min(metric.weight_x, metric.weight_y) - metric.slack) / metric.side;
  return std::nextafter(static_cast<float>(kRiseError / nearest), 1.0F);
}

FineRatios lower_cone_bounds(const BoundRequest& request) {
  Search result = search(request, Correction::safe);
  FineRatios& points = result.found;
  for (float& ratio : points.ratios)
    ratio = std::min(request.max_ratio, rounded_down(ratio / (1 + result.guard * ratio)));
  const int border = request.wrap == Wrap::clamp ? 1 : 0;
  FineRatios cells{.width = points.width - border, .height = points.height - border, .ratios = {}};
  cells.ratios.reserve(points.ratios.size());
  for (int j = 0; j < cells.height; ++j) {
    const int above = wrapped(j + 1, points.height, request.wrap);
    for (int i = 0; i < cells.width; ++i) {
      const int right = wrapped(i + 1, points.width, request.wrap);
      cells.ratios.push_back(
          std::min({points.at(i, j), points.at(right, j), points.at(i, above), points.at(right, above)}));
    }
  }
  return cells;
}

void keep_coarser(FineRatios& finer, const FineRatios& coarser) {
  const int parts_x = finer.width / coarser.width;
  const int parts_y = finer.height / coarser.height;
  for (int j = 0; j < finer.height; ++j) {
    for (int i = 0; i < finer.width; ++i) {
      float& ratio = finer.ratios[finer.index(i, j)];
      ratio = std::max(ratio, coarser.at(i / parts_x, j / parts_y));
    }
  }
}

FineRatios upper_cone_bounds(const BoundRequest& request) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Search result = search(request, Correction::none);
  for (float& ratio : result.found.ratios) {
    const double above = std::nextafter(ratio, kInfinity);  // the search rounds down
    const double rest = 1 - result.guard * above;
    const bool is_bound = ratio <= request.max_ratio && rest > 0;
    ratio = is_bound ? std::nextafter(static_cast<float>(above / rest), kInfinity) : kInfinity;
  }
  return std::move(result.found);
}

}  // namespace reliefbench
