#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"

namespace reliefbench {

// Why `safe` widens each sector by one texel: the coupling of the theorem at Correction pairs a corner of the cell of
// the cone's owner with a corner of the cell of the other point, and their offset takes per axis only the two integers
// round the points' own offset. So where the points' offset lies in the sector, every pair's is less than one texel
// per axis from it, and counts. The rest of the proof sees these pairs only.
std::vector<MarginedWedge> quad_wedges(const BakeRequest& request) {
  std::vector<MarginedWedge> all;
  all.reserve(kQuadWedges.size());
  for (const Wedge& wedge : kQuadWedges)
    all.push_back({.wedge = wedge, .margin = request.correction == Correction::safe ? 1.0 : 0.0});
  return all;
}

std::vector<float> bake_quad(const BakeRequest& request) {
  check_request(request, MapKind::quad);
  const Heightfield& heights = request.heights;
  constexpr std::size_t kCount = kQuadWedges.size();
  const std::vector<MarginedWedge> wedges = quad_wedges(request);
  std::vector<float> quads(kCount * heights.texels.size());
  for (std::size_t k = 0; k < kCount; ++k) {
    const auto& [wedge, margin] = wedges[k];
    std::vector<float> ratios =
        search_cones({.heights = heights,
                      .wrap = request.wrap,
                      .metric = cone_metric(heights.width, heights.height, request.correction),
                      .max_ratio = request.max_ratio,
                      .views = {wedge_view(heights, heights.width, heights.height, wedge, margin)},
                      .threads = request.threads});
    if (request.correction != Correction::none) ratios = min3x3(ratios, heights.width, heights.height, request.wrap);
    for (std::size_t i = 0; i < ratios.size(); ++i) quads[kCount * i + k] = ratios[i];
  }
  return quads;
}

}  // namespace reliefbench
