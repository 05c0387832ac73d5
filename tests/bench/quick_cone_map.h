#pragma once
#include <vector>

#include "kernels/heightfield.h"

namespace reliefbench {

/// The approximate cone map of [VB22] algorithm 2, for comparison: one thread, clamp, square maps of 2^n texels.
/// Conservative: no ratio is above the exact one. The regions of a corner neighbour that are not visited yet are
/// measured exactly, where the published shader is wrong.
/// returns: side x side ratios in [0, 1]
[[nodiscard]] std::vector<float> quick_cone_map(const Heightfield& heights);

}  // namespace reliefbench
