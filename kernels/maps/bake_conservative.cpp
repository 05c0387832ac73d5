#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"

namespace reliefbench {

std::vector<float> bake_conservative(const BakeRequest& request) {
  const Heightfield& heights = request.heights;
  check_request(request, MapKind::conservative);
  if (request.correction == Correction::certified) return certified_cones(request);
  std::vector<float> ratios = search_cones({.heights = heights,
                                            .wrap = request.wrap,
                                            .metric = cone_metric(heights.width, heights.height, request.correction),
                                            .max_ratio = request.max_ratio,
                                            .threads = request.threads});
  const bool is_minimum_at_run_time = request.correction == Correction::min4;
  if (request.correction == Correction::none || is_minimum_at_run_time) return ratios;
  return min3x3(ratios, heights.width, heights.height, request.wrap);
}

}  // namespace reliefbench
