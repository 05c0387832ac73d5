#pragma once
#include <vector>

#include "kernels/maps/map_kind.h"

namespace reliefbench {

/// Maximum pyramids as mip chains of width x height nodes: levels 0 to log2 of the longer side, one after the other,
/// each level_side wide and high. The sides round down, so that the last node of an odd level covers the rest: node
/// (x, y) of level n bounds the nodes of level 0 whose indices, shifted right by n and cut at the level's last node,
/// are (x, y). Maxima of stored heights are stored heights: nothing is rounded.

/// Maxima over the cells of the bilinear surface [TIS08]. Cell (i, j) lies between the centres of texels i and i + 1,
/// j and j + 1. Under repeat the last one wraps; under clamp it is the constant border beyond the last centre, and cell
/// 0 bounds the border before the first centre too, as that has no other heights.
/// throws: Error(bad_input) if either side is under 2 texels
[[nodiscard]] std::vector<float> bake_max_mip(const BakeRequest& request);

/// Maxima over texels, the quadtree of quadtree displacement mapping [DRO18]: level 0 is the heights. A node bounds its
/// texels, not the bilinear surface over their area, which rises towards neighbours in other nodes.
/// throws: Error(bad_input) if either side is under 2 texels
[[nodiscard]] std::vector<float> bake_quadtree(const BakeRequest& request);

/// The pyramid over any level 0 of width x height nodes, level 0 included.
[[nodiscard]] std::vector<float> maximum_levels(std::vector<float> level_0, int width, int height);

}  // namespace reliefbench
