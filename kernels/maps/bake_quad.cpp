#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"
#include "kernels/maps/sector_map.h"

namespace reliefbench {

// What makes `safe` true is the theorem at bake_sector: its sectors may lie as they like.
std::vector<MarginedWedge> quad_wedges(const BakeRequest& request) {
  std::vector<MarginedWedge> all;
  all.reserve(kQuadWedges.size());
  for (const Wedge& wedge : kQuadWedges)
    all.push_back({.wedge = wedge, .margin = request.correction == Correction::safe ? wedge.safe_margin : 0});
  return all;
}

std::vector<float> bake_quad(const BakeRequest& request) {
  check_request(request, MapKind::quad);
  const Heightfield& heights = request.heights;
  constexpr std::size_t kCount = kQuadWedges.size();
  const std::vector<MarginedWedge> wedges = quad_wedges(request);
  std::vector<float> quads(kCount * heights.texels.size());
  for (std::size_t k = 0; k < kCount; ++k) {
    const std::vector<float> ratios = wedge_cones(request, wedges[k]);
    for (std::size_t i = 0; i < ratios.size(); ++i) quads[kCount * i + k] = ratios[i];
  }
  return quads;
}

}  // namespace reliefbench
