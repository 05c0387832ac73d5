#include <cstdlib>

#include "kernels/maps/cell_map.h"
#include "kernels/maps/verify_cones.h"

namespace reliefbench {

CellVerdict verify_cell_cones(const CellCones& request) {
  const Heightfield& heights = request.heights;
  const std::vector<float> least = cell_tops(heights, request.wrap, request.threads);
  const BakeRequest bake{.heights = heights, .wrap = request.wrap, .max_ratio = 1, .threads = request.threads};
  const auto ratios = [&](Correction correction) {
    return cell_cones(bake, request.tops, cone_metric(heights.width, heights.height, correction));
  };
  const std::vector<float> sure = ratios(Correction::safe);
  const std::vector<float> widest = ratios(Correction::none);
  CellVerdict verdict{.cells = static_cast<std::int64_t>(sure.size()), .finest = 1};
  for (std::size_t i = 0; i < sure.size(); ++i) {
    const std::size_t cell = i % least.size();
    const auto ratio = static_cast<double>(request.ratios[i]);
    const bool is_under = request.tops[cell] < least[cell];
    if (is_under || ratio * kWitnessGuard > static_cast<double>(widest[i])) {
      ++verdict.broken;
      const auto [y, x] = std::div(static_cast<int>(cell), heights.width);
      keep_worse(verdict.worst, {.factor = ratio / static_cast<double>(widest[i]),
                                 .u = (x + 1.0) / heights.width,
                                 .v = (y + 1.0) / heights.height});
    } else {
      ++(request.ratios[i] <= sure[i] ? verdict.proved : verdict.undecided);
    }
  }
  return verdict;
}

}  // namespace reliefbench
