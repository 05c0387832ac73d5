#pragma once
#include <span>
#include <vector>

#include "kernels/maps/map_kind.h"

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
/// it keeps below the bound of the cell if it does at its corners: no interpolated cone meets the surface.
/// throws: Error(bad_input) if either side is under 2 texels
[[nodiscard]] std::vector<float> certified_cones(const BakeRequest& request);

inline constexpr MapParam kSearchSteps{.id = "search_steps",
                                       .description = "forward steps of the bake's search for a ray's exit",
                                       .min = 1,
                                       .max = 4096,
                                       .fallback = 128};
/// The relaxed cone map of [PO07] listings 18-1 and 18-2 (18-2's denominator), all pairs by branch and bound.
/// A ray leaves the top plate over one texel and passes through another's surface point, under repeat its nearest
/// image; it goes down to z = 0 in `search_steps` steps from there, and bounds the cone where it is first above the
/// bilinear surface again. It may end outside a clamped map. Through a point of the top plate itself the ray is level
/// (the listing divides by zero), and the point bounds the cone. Features thinner than a step may go unseen.
/// throws: Error(bad_input) if either side is under 2 texels, search_steps are out of range, or the row has no such
/// correction
[[nodiscard]] std::vector<float> bake_relaxed_po07(const BakeRequest& request);

/// [VB22]: 3 x 3 nodes on every level of a max pyramid, Theta(N^2 log N). `quick_naive` is algorithm 1, `quick`
/// algorithm 2 with the unvisited part of a corner neighbour measured exactly; both are never above bake_conservative,
/// texel by texel. `quick_published` measures the corners as the authors' shader does, `quick_centre` from the nodes'
/// centres; both may be too wide. Beyond the paper: sides of any size, repeat, `safe` distances.
/// throws: Error(bad_input) if either side is under 2 texels, or the row has no such correction
[[nodiscard]] std::vector<float> bake_quick_naive(const BakeRequest& request);
[[nodiscard]] std::vector<float> bake_quick(const BakeRequest& request);
[[nodiscard]] std::vector<float> bake_quick_published(const BakeRequest& request);
[[nodiscard]] std::vector<float> bake_quick_centre(const BakeRequest& request);

/// The exact relaxed cone map [BVBV24] algorithm 2: min |v-u| / (H(v)-H(u)) over the texels v whose cell behind v goes
/// down along an edge that points away from u. Behind: in the quadrant in which u sees v; on an axis, in both. Under
/// repeat every image of v counts, in its own quadrant: the nearest alone would miss the far end of a plateau that is
/// wider than half a tile. Branch and bound on a max pyramid a quadrant, bit-identical to a loop over all pairs.
/// `safe` takes the slack of bake_conservative off the squared distance; it is not proved for relaxed cones.
/// throws: Error(bad_input) if either side is under 2 texels, or the row has no such correction
[[nodiscard]] std::vector<float> bake_relaxed(const BakeRequest& request);

/// Four exact conservative ratios a texel, for +x, -x, +y, -y, interleaved: the one for +x over the texels with
/// |dv| <= du, and so on, in uv; under repeat over all their images. `safe` counts the texels within one texel of the
/// sector too, and makes distances shorter as bake_conservative does.
/// throws: Error(bad_input) if either side is under 2 texels, or the row has no such correction
[[nodiscard]] std::vector<float> bake_quad(const BakeRequest& request);

/// The mean of the exact conservative and the exact relaxed ratio, then the correction.
/// throws: Error(bad_input) if either side is under 2 texels, or the row has no such correction
[[nodiscard]] std::vector<float> bake_hybrid(const BakeRequest& request);

/// After [BES12], whose own shape is not public: the union of a relaxed cone and an upright cylinder, in which a ray
/// that goes down and starts over the texel's surface point crosses the surface at most once. Two values a texel: the
/// ratio of bake_relaxed, and the cylinder's radius in uv, at most 1: the distance to the nearest cell in which the
/// surface may go down, or, under the texel's height, may sink out of the texel's sight. Rounded down. `min3x3` makes
/// both hold for interpolated values: for the radius the 3x3 minimum less a texel's diagonal, and 0 over a twisted
/// cell. throws: Error(bad_input) if either side is under 2 texels, or the row has no such correction
[[nodiscard]] std::vector<float> bake_safety_shape(const BakeRequest& request);

/// The minimum over each texel's 3x3 neighbourhood, wrapped.
[[nodiscard]] std::vector<float> min3x3(std::span<const float> ratios, int width, int height, Wrap wrap);

}  // namespace reliefbench
