#pragma once
#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "kernels/image/heightfield.h"
#include "kernels/judge/reference.h"

namespace reliefbench {

/// An oracle for ReferenceTracer on solids that shares nothing with it: 113-bit floats, every cell on the way, the cell
/// found from the middle of its stretch, crossings by bisection of monotone stretches.
class SlowSolid {
 public:
  __extension__ using Quad = __float128;

  SlowSolid(const Heightfield& solid, Wrap wrap, const TextureRay& ray)
      : solid_(solid),
        wrap_(wrap),
        x_{Quad(ray.u) * solid.width - Quad(0.5), Quad(ray.slope_u) * solid.width},
        y_{Quad(ray.v) * solid.height - Quad(0.5), Quad(ray.slope_v) * solid.height} {}

  [[nodiscard]] ReferenceHit trace() const {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    ReferenceHit hit{.t_enter = kNone, .t_exit = kNone};
    bool is_inside = false;
    for (Quad t = 0; t < 1;) {
      const Quad next = std::min<Quad>(std::min(x_.next_crossing(t), y_.next_crossing(t)), 1);
      const Cell cell = cell_at((t + next) / 2);
      std::array<Quad, 4> stops{t, vertex(cell, t, next, &Cell::tops), vertex(cell, t, next, &Cell::floors), next};
      std::ranges::sort(stops);
      for (std::size_t i = 0; i + 1 < stops.size(); ++i) {
        Quad from = stops.at(i);
        const Quad to = stops.at(i + 1);
        if (!is_inside) {
          const std::optional<Quad> enter = entry(cell, from, to);
          if (!enter) continue;
          hit.t_enter = static_cast<double>(from = *enter);
          is_inside = true;
        }
        if (const std::optional<Quad> exit = way_out(cell, from, to)) {
          hit.t_exit = static_cast<double>(*exit);
          return hit;
        }
      }
      t = next;
    }
    return hit;
  }

  /// How far outside the solid the ray is at t; negative inside.
  [[nodiscard]] double outside(double t) const {
    const Cell cell = cell_at(t);
    return static_cast<double>(std::max(over(cell, t), under(cell, t)));
  }

 private:
  struct Line {
    Quad start;
    Quad speed;
    [[nodiscard]] Quad at(Quad t) const { return start + speed * t; }
    [[nodiscard]] Quad next_crossing(Quad t) const {
      if (speed == 0) return 2;
      Quad k = speed > 0 ? floor_of(at(t)) : -floor_of(-at(t));
      Quad crossing = t;
      while (crossing <= t) {
        crossing = (k - start) / speed;
        k += speed > 0 ? 1 : -1;
      }
      return crossing;
    }
  };
  /// Its lower texel, and its corners (0,0), (1,0), (0,1), (1,1).
  struct Cell {
    Quad x, y;
    std::array<Quad, 4> tops;
    std::array<Quad, 4> floors;
    bool is_empty;
  };

  static Quad floor_of(Quad x) {
    const auto whole = static_cast<Quad>(static_cast<long long>(x));
    return whole > x ? whole - 1 : whole;
  }
  [[nodiscard]] Cell cell_at(Quad t) const {
    Cell cell{.x = floor_of(x_.at(t)), .y = floor_of(y_.at(t)), .tops = {}, .floors = {}, .is_empty = true};
    for (int i = 0; i < 4; ++i) {
      const int x = wrapped(static_cast<int>(cell.x) + i % 2, solid_.width, wrap_);
      const int y = wrapped(static_cast<int>(cell.y) + i / 2, solid_.height, wrap_);
      cell.tops.at(static_cast<std::size_t>(i)) = solid_.at(x, y);
      cell.floors.at(static_cast<std::size_t>(i)) = solid_.floor_at(x, y);
      cell.is_empty = cell.is_empty && solid_.at(x, y) <= solid_.floor_at(x, y);
    }
    return cell;
  }
  [[nodiscard]] Quad height(const Cell& cell, const std::array<Quad, 4>& h, Quad t) const {
    const Quad fx = x_.at(t) - cell.x;
    const Quad fy = y_.at(t) - cell.y;
    const Quad south = h[0] + (h[1] - h[0]) * fx;
    return south + (h[2] + (h[3] - h[2]) * fx - south) * fy;
  }
  [[nodiscard]] Quad over(const Cell& cell, Quad t) const { return 1 - t - height(cell, cell.tops, t); }
  [[nodiscard]] Quad under(const Cell& cell, Quad t) const { return height(cell, cell.floors, t) - (1 - t); }

  /// Where a surface's height along the ray turns inside (from, to); else `to`.
  [[nodiscard]] Quad vertex(const Cell& cell, Quad from, Quad to, std::array<Quad, 4> Cell::*surface) const {
    const auto gap = [&](Quad t) { return 1 - t - height(cell, cell.*surface, t); };
    const Quad middle = (from + to) / 2;
    const Quad bend = gap(from) - 2 * gap(middle) + gap(to);
    if (bend == 0) return to;
    return std::clamp(middle + (gap(from) - gap(to)) / (4 * bend) * (to - from), from, to);
  }
  /// The first point of [from, to] where a monotone `holds` does, if any.
  template <typename Holds>
  static std::optional<Quad> first(Quad from, Quad to, const Holds& holds) {
    if (holds(from)) return from;
    if (!holds(to)) return std::nullopt;
    for (int i = 0; i < 100; ++i) {
      const Quad middle = (from + to) / 2;
      (holds(middle) ? to : from) = middle;
    }
    return to;
  }
  [[nodiscard]] std::optional<Quad> entry(const Cell& cell, Quad from, Quad to) const {
    if (cell.is_empty) return std::nullopt;
    const auto by_top = first(from, to, [&](Quad t) { return over(cell, t) <= 0; });
    const auto by_floor = first(from, to, [&](Quad t) { return under(cell, t) <= 0; });
    if (!by_top || !by_floor) return std::nullopt;
    const Quad t = std::max(*by_top, *by_floor);
    return over(cell, t) <= 0 && under(cell, t) <= 0 ? std::optional(t) : std::nullopt;
  }
  [[nodiscard]] std::optional<Quad> way_out(const Cell& cell, Quad from, Quad to) const {
    if (cell.is_empty) return from;
    const auto by_top = first(from, to, [&](Quad t) { return over(cell, t) > 0; });
    const auto by_floor = first(from, to, [&](Quad t) { return under(cell, t) > 0; });
    if (!by_top) return by_floor;
    return by_floor ? std::min(*by_top, *by_floor) : by_top;
  }

  const Heightfield& solid_;
  Wrap wrap_;
  Line x_;
  Line y_;
};

}  // namespace reliefbench
