#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/maps/pyramid_map.h"

namespace reliefbench {

std::vector<float> bake_max_mip(const BakeRequest& request) {
  const Heightfield& heights = request.heights;
  check_bakeable(heights);
  const int width = heights.width;
  std::vector<float> cells(heights.texels.size());
  parallel_for(heights.height, request.threads, [&](int y) {
    const int above = wrapped(y + 1, heights.height, request.wrap);
    for (int x = 0; x < width; ++x) {
      const int right = wrapped(x + 1, width, request.wrap);
      cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          std::max({heights.at(x, y), heights.at(right, y), heights.at(x, above), heights.at(right, above)});
    }
  });
  return maximum_levels(std::move(cells), width, heights.height);
}

}  // namespace reliefbench
