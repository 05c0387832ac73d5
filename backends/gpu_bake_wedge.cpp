#include "backends/gpu_bake_wedge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/maps/cell_map.h"

namespace reliefbench {
namespace {

BakeWedge bake_wedge(const MarginedWedge& margined, const BakeGrid& grid, Wrap wrap) {
  const auto [width, height] = std::pair(grid.uv_width, grid.uv_height);
  const Heightfield none;
  const ConeView view = wedge_view(none, width, height, margined.wedge, margined.margin);
  const auto [x, y] = margined.wedge.quadrant;
  BakeWedge wedge{.quadrant = {static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)},
                  .is_bounded = is_bounded(margined.wedge, wrap) ? 1 : 0};
  for (std::size_t i = 0; i < view.normals.size(); ++i) {
    const auto [across, along] = view.normals.at(i);
    const double length = std::abs(across) + std::abs(along);
    // Twice the way to the middle of a node of an image two tiles away, a node being up to two sides long, and that.
    constexpr int kFarthestSides = 12;
    if (length * kFarthestSides * std::max(width, height) > std::numeric_limits<std::int32_t>::max())
      fail_environment(
          "{}x{} texels, whose sides have no large divisor in common, are too many for a GPU's baker of cones by "
          "direction; the CPU bakes them",
          width, height);
    wedge.normals.at(i) = {static_cast<std::int32_t>(across), static_cast<std::int32_t>(along)};
    wedge.least.at(i) = static_cast<std::int32_t>(std::ceil(-view.margin * length));
  }
  return wedge;
}

}  // namespace

std::vector<BakeWedge> bake_wedges(const std::vector<MarginedWedge>& margined, const BakeGrid& grid, Wrap wrap) {
  std::vector<BakeWedge> wedges;
  wedges.reserve(margined.size());
  for (const MarginedWedge& wedge : margined) wedges.push_back(bake_wedge(wedge, grid, wrap));
  return wedges;
}

std::vector<BakeWedge> cell_wedges(std::size_t place, const BakeGrid& grid) {
  std::vector<BakeWedge> wedges;
  wedges.reserve(kQuarters);
  for (int k = 0; k < kQuarters; ++k) {
    const CellSearch search = cell_searches(k).at(place);
    // Corners look at the map alone: beyond its end the theorem asks for no more.
    BakeWedge& wedge = wedges.emplace_back(bake_wedge({.wedge = search.wedge}, grid, Wrap::repeat));
    wedge.corner = {search.corner.x, search.corner.y};
    wedge.is_of_cells = 1;
    wedge.goes_on = place > 0 ? 1 : 0;
  }
  return wedges;
}

}  // namespace reliefbench
