#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/base/rounding.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"
#include "kernels/maps/pyramid_map.h"
#include "kernels/maps/solid_map.h"

namespace reliefbench {

void check_solid(const Heightfield& heights) {
  check_bakeable(heights);
  if (heights.floors.size() != heights.texels.size())
    fail_input("the heightmap has one height a texel; a solid needs two, a floor beside the top");
}

Heightfield mirrored_floors(const Heightfield& heights) {
  Heightfield below{.width = heights.width, .height = heights.height, .texels = heights.floors};
  for (float& floor : below.texels) floor = 1.0F - floor;
  return below;
}

std::vector<float> bake_double_cone(const BakeRequest& request) {
  const Heightfield& heights = request.heights;
  check_solid(heights);
  check_request(request, MapKind::double_cone);
  const Heightfield below = mirrored_floors(heights);
  const std::vector<float> up = bake_conservative(request);
  const std::vector<float> down = bake_conservative({.heights = below,
                                                     .wrap = request.wrap,
                                                     .correction = request.correction,
                                                     .max_ratio = request.max_ratio,
                                                     .threads = request.threads});
  // A true ratio is d / (D + error) where d / D was found, and d is the least distance or more.
  const ConeMetric metric = cone_metric(heights.width, heights.height, request.correction);
  const double nearest = std::sqrt(std::min(metric.weight_x, metric.weight_y) - metric.slack) / metric.side;
  std::vector<float> ratios;
  ratios.reserve(2 * up.size());
  for (std::size_t i = 0; i < up.size(); ++i) {
    const auto ratio = static_cast<double>(down[i]);
    ratios.push_back(up[i]);
    ratios.push_back(rounded_down(ratio / (1 + kMirrorError * ratio / nearest)));
  }
  return ratios;
}

std::vector<float> bake_double_mip(const BakeRequest& request) {
  const Heightfield& heights = request.heights;
  check_solid(heights);
  const int width = heights.width;
  std::vector<float> tops(heights.texels.size(), 0.0F);
  std::vector<float> mirrored(heights.texels.size(), -1.0F);  // of floors, so that minima are maxima
  parallel_for(heights.height, request.threads, [&](int y) {
    const int above = wrapped(y + 1, heights.height, request.wrap);
    for (int x = 0; x < width; ++x) {
      const int right = wrapped(x + 1, width, request.wrap);
      const std::array corners{heights.index(x, y), heights.index(right, y), heights.index(x, above),
                               heights.index(right, above)};
      const auto is_thick = [&](std::size_t i) { return heights.texels[i] > heights.floors[i]; };
      if (std::ranges::none_of(corners, is_thick)) continue;
      float top = 0;
      float floor = 1;
      for (const std::size_t i : corners) {
        top = std::max(top, heights.texels[i]);
        floor = std::min(floor, heights.floors[i]);
      }
      tops[heights.index(x, y)] = top;
      mirrored[heights.index(x, y)] = -floor;
    }
  });
  const std::vector<float> highest = maximum_levels(std::move(tops), width, heights.height);
  const std::vector<float> lowest = maximum_levels(std::move(mirrored), width, heights.height);
  std::vector<float> nodes;
  nodes.reserve(2 * highest.size());
  for (std::size_t i = 0; i < highest.size(); ++i) {
    nodes.push_back(highest[i]);
    nodes.push_back(-lowest[i]);
  }
  return nodes;
}

}  // namespace reliefbench
