#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kernels/image/heightfield.h"

namespace reliefbench {

/// A ray in texture space: p(t) = (u + slope_u t, v + slope_v t), height z(t) = 1 - t, t in [0, 1].
/// uv in tiles, slope in uv per unit of height. It enters at the top plate at t = 0 and leaves at the bottom, t = 1.
struct TextureRay {
  float u = 0;
  float v = 0;
  float slope_u = 0;
  float slope_v = 0;
};

/// The exact first solid interval along a ray.
struct ReferenceHit {
  /// First t with z(t) <= surface, in [0, 1] since heights are >= 0. Of a solid: first t at which the ray is between
  /// both surfaces. +infinity where the ray passes: through a solid, or beside what lies on a curved surface
  double t_enter = 0;
  double t_exit = 0;  ///< end of that solid interval; +infinity where the ray stays inside to the bottom, or passes
  [[nodiscard]] bool passes() const { return t_enter == std::numeric_limits<double>::infinity(); }
};

/// A ray that rises from the surface: p(s) = (u + slope_u s, v + slope_v s) when it has risen by s, in heights.
/// uv in tiles, slope in uv per unit of height.
struct RisingRay {
  double u = 0;
  double v = 0;
  double slope_u = 0;
  double slope_v = 0;
  double z = 0;     ///< it begins at this height where that is over the surface
  double lift = 0;  ///< and by so much higher
};

/// Exact first hits of rays on the bilinear surface, in double precision, cell by cell. Where the heights have floors
/// (Heightfield::floors), on the solid between both surfaces: closed, in cells with a texel over its floor.
/// Immutable after construction; trace() is safe from many threads.
class ReferenceTracer {
 public:
  ReferenceTracer(const Heightfield& heights, Wrap wrap);  ///< throws: Error if either side is under 2 texels

  [[nodiscard]] Wrap wrap() const { return wrap_; }

  /// The ray's floats are taken exactly. A touch (in and out at one point) has t_exit == t_enter. A ray that is not
  /// finite, or whose travel exceeds kMaxTravel, counts as parallel to the plate: it enters at the highest texel's
  /// height and never leaves; it passes a solid.
  [[nodiscard]] ReferenceHit trace(const TextureRay& ray) const;
  [[nodiscard]] double first_hit(const TextureRay& ray) const;  ///< trace(ray).t_enter, for less work
  [[nodiscard]] std::vector<ReferenceHit> trace(std::span<const TextureRay> rays, int threads = 0) const;

  /// Whether nothing of the surface stands over the ray, up to the highest texel. A ray that lies under it by no more
  /// than kTouch is not under it, so that one along the surface itself is lit. A position on the way has 52 bits; where
  /// that is coarser than kTouch, a shadow's edge lies by as much aside. A ray that is not finite, or whose travel
  /// exceeds kMaxTravel, is as good as level: it is not lit. Of heights without floors.
  [[nodiscard]] bool is_lit(const RisingRay& ray) const;

  struct HeightRange {
    double min, max;
  };
  /// The four texels round a cell of the bilinear surface: at its lower corner, along x, along y, across.
  struct Corners {
    double h00, h10, h01, h11;
    /// At fractions of the cell.
    [[nodiscard]] double at(double fx, double fy) const {
      return (h00 * (1 - fx) + h10 * fx) * (1 - fy) + (h01 * (1 - fx) + h11 * fx) * fy;
    }
    [[nodiscard]] HeightRange range() const {
      return {std::min(std::min(h00, h10), std::min(h01, h11)), std::max(std::max(h00, h10), std::max(h01, h11))};
    }
  };
  /// Of the cell whose lower texel is (x, y), any whole numbers.
  [[nodiscard]] Corners corners(std::int64_t x, std::int64_t y) const;
  /// Of the texels that cells touch, from (x0, y0) to (x1, y1): never too narrow.
  [[nodiscard]] HeightRange height_range(std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1) const;
  [[nodiscard]] HeightRange height_range() const { return {bounds_.min, bounds_.max}; }
  [[nodiscard]] int width() const { return width_; }    ///< texels
  [[nodiscard]] int height() const { return height_; }  ///< texels

  static constexpr double kTouch = 0x1p-40;  ///< of height
  static constexpr int kVersion = 2;         ///< part of the cache key; raised when a result changes
  /// Texels from top to bottom along either axis. Up to here the double t places a ray to 2^-21 texel.
  static constexpr double kMaxTravel = 4294967296.0;

 private:
  /// Lowest and highest texel that a node's cells touch.
  struct Bounds {
    float min;
    float max;
  };
  static constexpr Bounds kEmpty{.min = std::numeric_limits<float>::max(), .max = std::numeric_limits<float>::lowest()};
  /// Nodes of 2^level x 2^level cells, fewer at the far sides, so that every size is covered.
  struct Level {
    int width = 0;
    std::vector<Bounds> nodes;
  };
  class CellWalk;
  class Walk;
  class LightWalk;
  class SolidWalk;

  template <typename Fine>
  [[nodiscard]] static Level coarser(int width, int height, int reach, const Fine& fine);
  [[nodiscard]] int padded(std::int64_t cell, int side, int cells) const;
  void build_solid(const Heightfield& heights);  ///< floors_, and the level of cells
  [[nodiscard]] ReferenceHit trace_solid(const TextureRay& ray) const;

  Wrap wrap_;
  int width_;  ///< of the map, texels
  int height_;
  int cells_x_;  ///< repeat: one cell a texel; clamp: one more, as a border cell on each side runs to infinity
  int cells_y_;
  std::vector<float> corners_;  ///< (cells_x_ + 1) x (cells_y_ + 1): the texels, wrapped on
  std::vector<Level> levels_;   ///< [0] is empty: a cell's bounds are found from its corners
  std::vector<float> floors_;   ///< of a solid, as corners_; levels_ then bound its parts, from [0] on
  Bounds bounds_{};             ///< of the whole map
};

}  // namespace reliefbench
