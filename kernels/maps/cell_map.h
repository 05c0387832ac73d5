#pragma once
#include <array>
#include <vector>

#include "kernels/maps/cone_search.h"

namespace reliefbench {

// Cones of the bilinear surface's cells: one for each quarter of the directions, which stands on the highest corner of
// its cell and clears the surface from every point over the cell. A ray reads it by one fetch, with nothing
// interpolated; under that height the cell itself is solved. Cell (i, j) lies between the centres of texels i and i +
// 1, j and j + 1, as in bake_max_mip; under clamp rays beyond the map read the cell that is nearest.

/// The quarters of directions, in the order of sectors: bit 0: towards -x, bit 1: -y.
inline constexpr int kQuarters = 4;

/// The highest of each cell's corners. threads: 0: as many as the machine has
[[nodiscard]] std::vector<float> cell_tops(const Heightfield& heights, Wrap wrap, int threads);

/// A corner of each cell, in cells from its lower left one.
struct CellCorner {
  int x, y;
};
/// What one corner of a cell sees, raised to the cell's top, in a part of a quarter of the directions.
struct CellSearch {
  CellCorner corner;
  Wedge wedge;
  bool is_axis = false;  ///< then distances count as they are, else as for `safe`
};
/// The searches of a quarter: the least of their ratios is the cell's. See the theorem at bake_cell.cpp.
[[nodiscard]] std::array<CellSearch, 3> cell_searches(int quarter);

/// The ratios that `bake_cell` stores, a layer of width x height after the other. metric: how far a corner of a cell
/// and a texel before it are apart; Correction::none: as they are, for what no ratio may exceed
/// tops: of the cells, at least cell_tops
[[nodiscard]] std::vector<float> cell_cones(const BakeRequest& request, const std::vector<float>& tops,
                                            const ConeMetric& metric);

/// throws: Error(bad_input) if either side is under 2 texels, or the greatest ratio is over 1: images of a repeated
/// texel then count that are farther away than bakers look
void check_cells(const BakeRequest& request);
/// throws as check_cells
[[nodiscard]] std::vector<float> bake_cell(const BakeRequest& request);

}  // namespace reliefbench
