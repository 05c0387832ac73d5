#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "kernels/maps/cone_search.h"
#include "kernels/maps/fine_grid.h"

namespace reliefbench {

/// Ratios at the points or cells of a finer grid, row-major. Point (i, j) is at texel coordinates (i / by.x, j / by.y)
/// and the lower left corner of cell (i, j); under clamp there is one cell less than points along each axis.
struct FineRatios {
  int width = 0;
  int height = 0;
  std::vector<float> ratios;
  [[nodiscard]] std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i);
  }
  [[nodiscard]] float at(int i, int j) const { return ratios[index(i, j)]; }
};

struct BoundRequest {
  const Heightfield& heights;
  Wrap wrap = Wrap::repeat;
  Subdivision by{};
  float max_ratio = 1;           ///< wider cones do not matter
  std::optional<Wedge> wedge{};  ///< only points in it bound the cone
  int threads = 0;
};

// The true ratio of a point of the bilinear surface is the greatest whose open cone holds no point of the surface, at
// most max_ratio. Both bounds come from one search over pairs of fine points (cone_search.h). Fine heights are under
// the surface by less than 2^-24, so a rise is off by less than e = 2^-24; a pair at distance d of ratio r = d/rise has
// a true ratio between 1/(1/r + e/d) and 1/(1/r - e/d), and d is at least the least distance of two fine points. Both
// grow with r, so the guard is put on the result. On the map's own grid heights are exact and there is none.

/// Searches go so far beyond max_ratio that the guard stays clear of it.
inline constexpr float kBoundsBeyond = 1 + 0x1p-6F;
/// e/d for the least distance d of two fine points, in 1 / uv, rounded up; 0 on the map's own grid.
[[nodiscard]] float rise_guard(const Heightfield& heights, Subdivision by, Correction correction);

/// For every fine cell a ratio that the true ones of its points are at least: the least S of its corners, by the
/// theorem at Correction, on the finer grid; its proof uses no corners but those of the two points' cells. Rounded
/// down. throws: Error(bad_input) if a side is under 2 texels
[[nodiscard]] FineRatios lower_cone_bounds(const BoundRequest& request);

/// Cells know what was proved of the coarser cells that they are part of: it is kept where it is more.
void keep_coarser(FineRatios& finer, const FineRatios& coarser);

/// For every fine point a ratio that the true one there does not exceed, as fine points alone bound the cone; infinity
/// where none does within max_ratio. Rounded up.
/// throws: Error(bad_input) if a side is under 2 texels
[[nodiscard]] FineRatios upper_cone_bounds(const BoundRequest& request);

}  // namespace reliefbench
