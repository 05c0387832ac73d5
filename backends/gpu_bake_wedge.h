#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "backends/gpu_bake_buffer.h"

namespace reliefbench {

/// Wedge of bake_wedge.comp.
struct BakeWedge {
  std::array<std::array<std::int32_t, 2>, 4> normals{};
  std::array<std::int32_t, 4> least{};
  std::array<std::int32_t, 2> quadrant{};
  std::array<std::int32_t, 2> corner{};
  std::int32_t is_bounded = 0;
  std::int32_t is_of_cells = 0;
  std::int32_t goes_on = 0;
  std::int32_t place = 0;  // takes the place
};
/// Wedges in whole numbers.
/// throws: Error(environment): they are too large for a shader's
[[nodiscard]] std::vector<BakeWedge> bake_wedges(const std::vector<MarginedWedge>& margined, const BakeGrid& grid,
                                                 Wrap wrap);
/// Of cells, the search of each quarter that cell_searches() has at this place.
[[nodiscard]] std::vector<BakeWedge> cell_wedges(std::size_t place, const BakeGrid& grid);

}  // namespace reliefbench
