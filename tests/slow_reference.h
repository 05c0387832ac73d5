#pragma once
#include <algorithm>
#include <cstdlib>
#include <limits>

#include "kernels/image/heightfield.h"
#include "kernels/judge/reference.h"

namespace reliefbench {

/// An oracle for ReferenceTracer that shares nothing with it: 113-bit floats, every cell on the way, the cell found
/// from the middle of its stretch, and roots by bisection between the extremes instead of a formula.
class SlowReference {
 public:
  __extension__ using Quad = __float128;

  struct Hit {
    Quad enter = 1;
    Quad exit = std::numeric_limits<double>::infinity();
  };
  struct Range {
    Quad lowest = std::numeric_limits<double>::max();
    Quad highest = std::numeric_limits<double>::lowest();
  };

  SlowReference(const Heightfield& map, Wrap wrap, const TextureRay& ray)
      : map_(map),
        wrap_(wrap),
        x_{Quad(ray.u) * map.width - Quad(0.5), Quad(ray.slope_u) * map.width},
        y_{Quad(ray.v) * map.height - Quad(0.5), Quad(ray.slope_v) * map.height} {}

  [[nodiscard]] Hit trace() const {
    Hit hit;
    bool is_inside = false;
    for_each_piece(0, 1, [&](const Piece& piece) {
      Quad from = piece.from;
      if (!is_inside) {
        if (above(piece, from) > 0) {
          if (above(piece, piece.to) > 0) return true;
          from = bisect(piece, from, [&](Quad t) { return above(piece, t) <= 0; });
        }
        is_inside = true;
        hit.enter = from;
      }
      if (above(piece, piece.to) <= 0) return true;
      hit.exit = above(piece, from) > 0 ? from : bisect(piece, from, [&](Quad t) { return above(piece, t) > 0; });
      return false;
    });
    return hit;
  }

  /// Lowest and highest value of the ray's height above the surface over [from, to].
  [[nodiscard]] Range range(Quad from, Quad to) const {
    Range range;
    for_each_piece(from, to, [&](const Piece& piece) {
      for (const Quad f : {above(piece, piece.from), above(piece, piece.to)}) {
        range.lowest = std::min(range.lowest, f);
        range.highest = std::max(range.highest, f);
      }
      return true;
    });
    return range;
  }
  [[nodiscard]] double above(double t) const {
    return static_cast<double>(above({floor_of(x_.at(t)), floor_of(y_.at(t)), t, t}, t));
  }

 private:
  struct Line {
    Quad start;
    Quad speed;
    [[nodiscard]] Quad at(Quad t) const { return start + speed * t; }
    /// t of the first crossing of a whole number after t.
    [[nodiscard]] Quad next_crossing(Quad t) const {
      if (speed == 0) return 2;
      const Quad x = at(t);
      Quad k = speed > 0 ? floor_of(x) : -floor_of(-x);
      Quad crossing = t;
      while (crossing <= t) {
        crossing = (k - start) / speed;
        k += speed > 0 ? 1 : -1;
      }
      return crossing;
    }
  };
  /// A stretch inside one cell over which the height above the surface is monotone.
  struct Piece {
    Quad x;
    Quad y;
    Quad from;
    Quad to;
  };

  static Quad floor_of(Quad x) {
    const auto whole = static_cast<Quad>(static_cast<long long>(x));
    return whole > x ? whole - 1 : whole;
  }

  [[nodiscard]] Quad above(const Piece& cell, Quad t) const {
    const Quad fx = x_.at(t) - cell.x;
    const Quad fy = y_.at(t) - cell.y;
    const auto texel = [&](int i, int j) {
      return Quad(map_.at(wrapped(static_cast<int>(cell.x) + i, map_.width, wrap_),
                          wrapped(static_cast<int>(cell.y) + j, map_.height, wrap_)));
    };
    const Quad south = texel(0, 0) + (texel(1, 0) - texel(0, 0)) * fx;
    const Quad north = texel(0, 1) + (texel(1, 1) - texel(0, 1)) * fx;
    return 1 - t - (south + (north - south) * fy);
  }

  /// The first point of a monotone piece where `reached` holds, which it does at the end.
  template <typename Reached>
  static Quad bisect(const Piece& piece, Quad low, const Reached& reached) {
    Quad high = piece.to;
    for (int i = 0; i < 100; ++i) {
      const Quad middle = (low + high) / 2;
      (reached(middle) ? high : low) = middle;
    }
    return high;
  }

  template <typename Visit>
  void for_each_piece(Quad from, Quad to, const Visit& visit) const {
    for (Quad t = from;;) {
      const Quad next = std::min(std::min(x_.next_crossing(t), y_.next_crossing(t)), to);
      const Quad middle = (t + next) / 2;
      const Piece cell{floor_of(x_.at(middle)), floor_of(y_.at(middle)), t, next};
      // The parabola's vertex from three values.
      const Quad left = above(cell, t);
      const Quad centre = above(cell, middle);
      const Quad right = above(cell, next);
      const Quad bend = left - 2 * centre + right;
      const Quad vertex = bend == 0 ? next : middle + (left - right) / (4 * bend) * (next - t);
      if (vertex > t && vertex < next) {
        if (!visit(Piece{cell.x, cell.y, t, vertex}) || !visit(Piece{cell.x, cell.y, vertex, next})) return;
      } else if (!visit(cell)) {
        return;
      }
      if (next >= to) return;
      t = next;
    }
  }

  const Heightfield& map_;
  Wrap wrap_;
  Line x_;
  Line y_;
};

}  // namespace reliefbench
