#pragma once
#include <array>
#include <vector>

#include "kernels/image/heightfield.h"

namespace reliefbench {

/// The exact cone map over all pairs, with no early-out: one thread, clamp, square maps. As wide in SIMD as the baker,
/// 4 x 4 texels against one target at a time, and the baker's own expression in double; the results are identical.
[[nodiscard]] std::vector<float> brute_cone_map(const Heightfield& heights);

/// Heights of the texels that limit a relaxed cone, -1 for the others: [up, down, level][left, right, same column].
using LimitingHeights = std::array<std::array<std::vector<float>, 3>, 3>;

/// The exact relaxed cone map likewise; the limiting texels of each quadrant are known beforehand.
[[nodiscard]] std::vector<float> brute_relaxed_map(const Heightfield& heights);

}  // namespace reliefbench
