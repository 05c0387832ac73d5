#pragma once
#include <vector>

#include "kernels/heightfield.h"

namespace reliefbench {

/// The exact cone map over all pairs, with no early-out: one thread, clamp, square maps. As wide in SIMD as the baker,
/// 4 x 4 texels against one target at a time, and the baker's own expression in double; the results are identical.
[[nodiscard]] std::vector<float> brute_cone_map(const Heightfield& heights);

}  // namespace reliefbench
