#pragma once
#include "kernels/image/heightfield.h"

namespace reliefbench {

/// Points a texel along each axis.
struct Subdivision {
  int x = 1;
  int y = 1;
  bool operator==(const Subdivision&) const = default;
};

/// The longest side, in points, of a finer grid that is worth its time and memory.
inline constexpr int kMaxFineSide = 4096;

/// k points a texel; for k > 1 as many more along the longer side of a texel as make the fine cells nearly square,
/// since the slack of bilinear-safe cones costs least there.
[[nodiscard]] Subdivision subdivision(int width, int height, int k);

/// Whether the finer grid of a map keeps within kMaxFineSide; the map's own grid always does.
[[nodiscard]] bool is_affordable(int width, int height, Subdivision by);

/// Points along one axis: repeat: n k, the torus; clamp: (n - 1) k + 1, as the surface is constant beyond the border.
[[nodiscard]] constexpr int fine_side(int side, int by, Wrap wrap) {
  return wrap == Wrap::repeat ? side * by : (side - 1) * by + 1;
}

/// The surface sampled finer. A bilinear surface restricted to a finer grid is bilinear on that grid, so the result
/// stands for the same surface; its heights are exact in double and rounded down to float, by less than 2^-24.
[[nodiscard]] Heightfield refine(const Heightfield& heights, Wrap wrap, Subdivision by);

}  // namespace reliefbench
