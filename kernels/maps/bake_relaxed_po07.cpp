#include <algorithm>
#include <cmath>
#include <cstdint>

#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"

namespace reliefbench {
namespace {

/// The nodes and the fraction between them along one axis, for a texel coordinate of any size.
struct Between {
  int low, high;
  double fraction;
};

Between between(double coordinate, int side, Wrap wrap) {
  if (wrap == Wrap::clamp) coordinate = std::clamp(coordinate, 0.0, side - 1.0);
  const double floor = std::floor(coordinate);
  auto low = static_cast<std::int64_t>(floor);
  if (low < 0 || low >= side) {
    low %= side;
    if (low < 0) low += side;
  }
  const int i = static_cast<int>(low);
  return {.low = i, .high = wrapped(i + 1, side, wrap), .fraction = coordinate - floor};
}

double bilinear(const Heightfield& heights, Wrap wrap, double x, double y) {
  const Between column = between(x, heights.width, wrap);
  const Between row = between(y, heights.height, wrap);
  const auto along = [&](int j) {
    const double left = heights.at(column.low, j);
    return left + column.fraction * (heights.at(column.high, j) - left);
  };
  const double top = along(row.low);
  return top + row.fraction * (along(row.high) - top);
}

/// Where the ray from the top plate over one texel, through another's surface point, leaves the relief again.
class ExitKey final : public PairKey {
 public:
  explicit ExitKey(const BakeRequest& request)
      : heights_(request.heights), wrap_(request.wrap), steps_(request.value(kSearchSteps)) {}

  double operator()(const ConePair& pair) const override {
    // At the top plate itself the ray runs level and enters nothing: the cone ends at the target.
    if (pair.target_height >= 1) return square_ratio(pair.distance2, pair.target_height - pair.height);
    const double travel = 1 / (1 - pair.target_height);
    for (int step = 1;; ++step) {
      const double z = pair.target_height * (1 - static_cast<double>(step) / steps_);
      const double rise = z - pair.height;
      if (rise <= 0) return pair.best;
      // Of the way from owner to target: (1 - z) / (1 - target_height), in a form that never rounds under 1.
      const double scale = 1 + (pair.target_height - z) * travel;
      const double key = square_ratio(pair.distance2 * (scale * scale), rise);
      // Farther on the ray is lower and farther away, so the key only grows: nothing to gain behind `best`.
      if (key >= pair.best || step == steps_) return key;
      if (bilinear(heights_, wrap_, pair.x + pair.dx * scale, pair.y + pair.dy * scale) < z) return key;
    }
  }

 private:
  static double square_ratio(double distance2, double rise) { return distance2 / (rise * rise); }

  const Heightfield& heights_;
  Wrap wrap_;
  int steps_;
};

}  // namespace

std::vector<float> bake_relaxed_po07(const BakeRequest& request) {
  const Heightfield& heights = request.heights;
  check_request(request, MapKind::relaxed_po07);
  const ExitKey exit_key(request);
  std::vector<float> ratios = search_cones({.heights = heights,
                                            .wrap = request.wrap,
                                            .metric = cone_metric(heights.width, heights.height, Correction::none),
                                            .max_ratio = request.max_ratio,
                                            .pair_key = &exit_key,
                                            .threads = request.threads});
  if (request.correction == Correction::none) return ratios;
  return min3x3(ratios, heights.width, heights.height, request.wrap);
}

}  // namespace reliefbench
