#include "kernels/judge/filter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "kernels/base/parallel.h"

namespace reliefbench {
namespace {

int inside(int i, int n, Edge edge) {
  if (edge == Edge::replicate) return std::clamp(i, 0, n - 1);
  const int period = 2 * n;
  const int j = ((i % period) + period) % period;
  return j < n ? j : period - 1 - j;
}

/// Correlation along one axis: every pixel of a line of `n`, read by at(i).
template <typename At, typename Store>
void filter_line(int n, const std::vector<double>& kernel, Edge edge, const At& at, const Store& store) {
  const int radius = static_cast<int>(kernel.size() / 2);
  for (int i = 0; i < n; ++i) {
    double sum = 0;
    int j = i - radius;
    for (const double weight : kernel) sum += weight * static_cast<double>(at(inside(j++, n, edge)));
    store(i, static_cast<float>(sum));
  }
}

}  // namespace

Plane filtered(const Plane& plane, const std::vector<double>& along_x, const std::vector<double>& along_y, Edge edge) {
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(plane.width) + static_cast<std::size_t>(x);
  };
  Plane rows = plane;
  parallel_for(plane.height, 0, [&](int y) {
    filter_line(
        plane.width, along_x, edge, [&](int x) { return plane.at(x, y); },
        [&](int x, float value) { rows.values[index(x, y)] = value; });
  });
  Plane result = rows;
  parallel_for(plane.width, 0, [&](int x) {
    filter_line(
        plane.height, along_y, edge, [&](int y) { return rows.at(x, y); },
        [&](int y, float value) { result.values[index(x, y)] = value; });
  });
  return result;
}

std::vector<double> gaussian(double sigma, int radius) {
  std::vector<double> kernel;
  for (int x = -radius; x <= radius; ++x) kernel.push_back(std::exp(-x * x / (2 * sigma * sigma)));
  return kernel;
}

}  // namespace reliefbench
