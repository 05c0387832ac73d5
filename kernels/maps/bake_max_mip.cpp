#include "kernels/maps/cell_map.h"
#include "kernels/maps/pyramid_map.h"

namespace reliefbench {

std::vector<float> bake_max_mip(const BakeRequest& request) {
  const Heightfield& heights = request.heights;
  check_bakeable(heights);
  return maximum_levels(cell_tops(heights, request.wrap, request.threads), heights.width, heights.height);
}

}  // namespace reliefbench
