#pragma once
#include <array>
#include <vector>

#include "kernels/maps/fine_grid.h"
#include "kernels/maps/map_kind.h"

namespace reliefbench {

// How certified_cones (cone_map.h) raises texels, for the CPU's baker and the GPU's: all in float, so that both have
// the same bits where sums and products round to nearest.

/// Points of a finer grid that limits stand at.
[[nodiscard]] Subdivision certified_points(const Heightfield& heights);

/// What a limit is taken by, over all rounding: of an interpolated ratio, all of whose terms are positive, at most
/// 8 x 2^-24; of the room that is left and of a rise, 4 x 2^-24; of the sum, 2^-24 each.
inline constexpr float kRaisingGuard = 1 - 0x1p-19F;

/// What a texel weighs at a point so many points away along an axis.
struct PointWeight {
  float share = 0;    ///< of the interpolated ratio
  float stretch = 0;  ///< 1 / share; 0 where that is 0
};
/// Of 0 to `by` points.
[[nodiscard]] std::vector<PointWeight> point_weights(int by);

/// The turns in which texels are raised. No two texels of one turn have weight at the same point, so that the result
/// does not depend on their order: along an axis, those at even places and those at odd ones; the last of an odd number
/// that repeats has a turn of its own.
class RaisingTurns {
 public:
  explicit RaisingTurns(const BakeRequest& request);
  [[nodiscard]] int count() const { return along_[0] * along_[1]; }
  [[nodiscard]] int of(int x, int y) const { return of_axis(x, 0) + along_[0] * of_axis(y, 1); }

 private:
  [[nodiscard]] int of_axis(int place, std::size_t axis) const {
    return along_[axis] == 3 && place == last_[axis] ? 2 : place % 2;
  }
  std::array<int, 2> along_{};
  std::array<int, 2> last_{};
};

}  // namespace reliefbench
