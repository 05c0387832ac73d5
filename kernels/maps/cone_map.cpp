#include "kernels/maps/cone_map.h"

#include <algorithm>
#include <numeric>

#include "kernels/maps/cone_search.h"

namespace reliefbench {

std::vector<float> min3x3(std::span<const float> ratios, int width, int height, Wrap wrap) {
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(wrapped(y, height, wrap)) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(wrapped(x, width, wrap));
  };
  // The minimum is separable: along the rows, then along the columns.
  std::vector<float> rows(ratios.size());
  std::vector<float> result(ratios.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      rows[index(x, y)] = std::min({ratios[index(x - 1, y)], ratios[index(x, y)], ratios[index(x + 1, y)]});
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      result[index(x, y)] = std::min({rows[index(x, y - 1)], rows[index(x, y)], rows[index(x, y + 1)]});
    }
  }
  return result;
}

ConeMetric cone_metric(int width, int height, Correction correction) {
  const int common = std::gcd(width, height);
  const double x = height / common;  // NOLINT(bugprone-integer-division): divides
  const double y = width / common;   // NOLINT(bugprone-integer-division): divides
  ConeMetric metric{.weight_x = x * x, .weight_y = y * y, .slack = 0, .side = x * width};
  if (correction != Correction::safe && correction != Correction::min4) return metric;
  // On a long map the theorem's slack swallows the step along the finer side, and the cones of most texels close.
  // d^2 / 2 is safe whatever the texels' shape: d <= |x| + |y| per axis, and those expectations are exact.
  if (std::max(x, y) > 1.5 * std::min(x, y)) {
    metric.weight_x /= 2;
    metric.weight_y /= 2;
  } else {
    metric.slack = (metric.weight_x + metric.weight_y) / 4;
  }
  return metric;
}

ConeView quadrant_view(const Heightfield& candidates, int x, int y) {
  const ConeView::Normal across{.x = static_cast<double>(x), .y = 0};
  const ConeView::Normal along{.x = 0, .y = static_cast<double>(y)};
  if (x == 0) return {.candidates = &candidates, .normals = {{along}}};
  return {.candidates = &candidates, .normals = {{across, along}}};
}

bool is_bounded(const Wedge& wedge, Wrap wrap) {
  const bool is_whole_quadrant = wedge.normals[2].x == 0 && wedge.normals[2].y == 0;
  return wrap == Wrap::clamp && !is_whole_quadrant;
}

ConeView wedge_view(const Heightfield& candidates, int width, int height, const Wedge& wedge, double margin) {
  // In a unit in which a step between texels is a whole number along both axes.
  const int common = std::gcd(width, height);
  const double step_x = height / common;  // NOLINT(bugprone-integer-division): divides
  const double step_y = width / common;   // NOLINT(bugprone-integer-division): divides
  ConeView view{.candidates = &candidates, .normals = wedge.normals, .margin = margin};
  for (ConeView::Normal& normal : view.normals) {
    normal.x *= step_x;
    normal.y *= step_y;
  }
  return view;
}

}  // namespace reliefbench
