#pragma once
#include <vector>

#include "kernels/maps/map_kind.h"

namespace reliefbench {

// Maps of solids between two bilinear surfaces (Heightfield::floors).

/// throws: Error(bad_input): no floors, or as check_bakeable()
void check_solid(const Heightfield& heights);

/// What mirroring two floors may put their difference off by.
inline constexpr double kMirrorError = 0x1p-24;
/// The lower surface upside down: 1 - floor, rounded to float.
[[nodiscard]] Heightfield mirrored_floors(const Heightfield& heights);

/// Two conservative cones a texel, interleaved: that of the upper surface, opening upwards from it, and that of the
/// lower surface, opening downwards.
///
/// Theorem: with `safe`, at every point of the map the interpolated upward cone over the upper surface, and the
/// downward cone under the lower one, hold no point of the solid. Proof: by that of Correction::safe the upward cone is
/// disjoint from the upper bilinear surface, so from all that lies under it, and the solid does; the downward one
/// likewise, the heights mirrored. A point outside the solid is over the upper surface or under the lower one (over
/// both and under both where there is nothing), so that one of the cones holds it: a ray there is free as far as it
/// stays inside.
///
/// Mirroring rounds a difference of two floors by 2^-24 at most, for which downward ratios are made smaller.
/// throws: Error(bad_input): no floors, a side under 2 texels, or the row has no such correction
[[nodiscard]] std::vector<float> bake_double_cone(const BakeRequest& request);

/// Highest top and lowest floor of each cell of the solid, interleaved, as mip chains (bake_max_mip says which cells
/// are which). A cell without a texel over its floor holds nothing: top 0, floor 1, and so has a node of nothing but
/// such. throws: Error(bad_input): no floors, or a side under 2 texels
[[nodiscard]] std::vector<float> bake_double_mip(const BakeRequest& request);

}  // namespace reliefbench
