#include <algorithm>
#include <array>

#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"

namespace reliefbench {

Heightfield limiting_heights(const Heightfield& heights, Wrap wrap, int x, int y) {
  Heightfield limiting = heights;
  auto texel = limiting.texels.begin();
  for (int j = 0; j < heights.height; ++j) {
    const int next_j = wrapped(j + y, heights.height, wrap);
    for (int i = 0; i < heights.width; ++i, ++texel) {
      const int next_i = wrapped(i + x, heights.width, wrap);
      const float near = heights.at(i, j);
      const float far = heights.at(next_i, next_j);
      const float across = heights.at(next_i, j);
      const float along = heights.at(i, next_j);
      if (near <= across && near <= along && across <= far && along <= far) *texel = -1;
    }
  }
  return limiting;
}

std::vector<float> bake_relaxed(const BakeRequest& request) {
  check_request(request, MapKind::relaxed);
  const Heightfield& heights = request.heights;
  std::array<Heightfield, 4> limiting;
  std::vector<ConeView> views;
  for (std::size_t quadrant = 0; quadrant < limiting.size(); ++quadrant) {
    const int x = quadrant % 2 == 0 ? 1 : -1;
    const int y = quadrant / 2 == 0 ? 1 : -1;
    limiting[quadrant] = limiting_heights(heights, request.wrap, x, y);
    views.push_back(quadrant_view(limiting[quadrant], x, y));
  }
  std::vector<float> ratios = search_cones({.heights = heights,
                                            .wrap = request.wrap,
                                            .metric = cone_metric(heights.width, heights.height, request.correction),
                                            .max_ratio = request.max_ratio,
                                            .views = std::move(views),
                                            .threads = request.threads});
  if (request.correction == Correction::none) return ratios;
  return min3x3(ratios, heights.width, heights.height, request.wrap);
}

std::vector<float> bake_hybrid(const BakeRequest& request) {
  check_request(request, MapKind::hybrid);
  BakeRequest plain = request;
  plain.correction = Correction::none;
  std::vector<float> ratios = bake_conservative(plain);
  const std::vector<float> relaxed = bake_relaxed(plain);
  // The mean of two floats is exact in double but for ratios of very different size, where it may be an ulp of it off.
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    const double mean = 0.5 * (static_cast<double>(ratios[i]) + static_cast<double>(relaxed[i]));
    ratios[i] = rounded_down(mean);
  }
  if (request.correction == Correction::none) return ratios;
  return min3x3(ratios, request.heights.width, request.heights.height, request.wrap);
}

}  // namespace reliefbench
