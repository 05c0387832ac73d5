#pragma once
#include <span>
#include <vector>

#include "kernels/map_kind.h"

namespace reliefbench {

/// The exact conservative cone map [DUM06]: for each texel min |v-u| / (H(v)-H(u)) over all texels v, clamped to 1.
/// Branch and bound on a max pyramid, bit-identical to brute force; the float is never above the double-precision
/// ratio. `safe` takes (1/width^2 + 1/height^2)/4 off the squared distance in uv; where one side is over 1.5 times the
/// other it halves the squared distance instead, which is as safe and leaves the cones open.
/// throws: Error(bad_input) if either side is under 2 texels
[[nodiscard]] std::vector<float> bake_conservative(const BakeRequest& request);

/// Conservative ratios for `certified`: the lower bounds of cone_bounds.h on a grid 4 times finer (less where that
/// would exceed kMaxFineSide) become limits of the interpolated ratio at its points; every texel begins at the least
/// limit round it and is raised, one after the other, as far as all limits allow. As C is bilinear on each fine cell,
/// it keeps below the bound of the cell if it does at its corners: no interpolated cone meets the surface. throws:
/// Error(bad_input) if either side is under 2 texels
[[nodiscard]] std::vector<float> certified_cones(const BakeRequest& request);

/// The relaxed cone map of [PO07] listings 18-1 and 18-2 (18-2's denominator), all pairs by branch and bound.
/// A ray leaves the top plate over one texel and passes through another's surface point, under repeat its nearest
/// image; it goes down to z = 0 in `search_steps` steps from there, and bounds the cone where it is first above the
/// bilinear surface again. It may end outside a clamped map. Through a point of the top plate itself the ray is level
/// (the listing divides by zero), and the point bounds the cone. Features thinner than a step may go unseen.
/// throws: Error(bad_input) if either side is under 2 texels, search_steps is under 1, or correction is neither none
/// nor min3x3
[[nodiscard]] std::vector<float> bake_relaxed_po07(const BakeRequest& request);

/// The minimum over each texel's 3x3 neighbourhood, wrapped.
[[nodiscard]] std::vector<float> min3x3(std::span<const float> ratios, int width, int height, Wrap wrap);

}  // namespace reliefbench
