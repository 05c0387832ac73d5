// Exact first hits on a solid between two bilinear surfaces.
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/judge/cell_walk.h"

namespace reliefbench {
namespace {

constexpr double kPasses = std::numeric_limits<double>::infinity();
/// A ray that enters by one surface may be outside of the other one by this much of height: where both are entered at
/// once, rounding may see either too late.
constexpr double kRim = 0x1p-50;

/// Where F falls to zero from above, s in [0, length], or kPasses. It does so once at most.
double falling_root(const Quadratic& f) {
  const bool is_above = f.f0 > 0;
  const bool is_below_then = f.f1 <= 0;
  const bool turns = std::abs(f.b) < 2 * std::abs(f.a) * f.length;  // inside the cell
  const bool dips = is_above && f.a > 0 && f.b < 0 && turns;
  const bool arcs = !is_above && is_below_then && f.a < 0 && f.b > 0 && turns;
  const bool must = is_above && is_below_then;
  if (!must && !dips && !arcs) return kPasses;
  const double disc = discriminant(f);
  if (!must && disc < 0) return kPasses;
  const double root = std::sqrt(std::max(disc, 0.0));
  return falling_zero(f, root);
}

/// Where F, not above zero at `from`, rises over it, s in [from, length], or kPasses.
double rising_root(const Quadratic& f, double from) {
  const bool must = f.f1 > 0;
  if (!must && !(f.a < 0 && f.b > 0)) return kPasses;  // it would have to come back
  const double disc = discriminant(f);
  if (!must && disc < 0) return kPasses;
  const double root = std::sqrt(std::max(disc, 0.0));
  const double s = f.b <= 0 ? (root - f.b) / (2 * f.a) : -2 * f.f0 / (f.b + root);
  if (s >= from && s < f.length) return s;
  if (!must) return kPasses;
  return s < from ? from : f.length;
}

}  // namespace

/// A ray on its way down. Nodes that hold nothing at the ray's heights are skipped on the way to the
/// solid.
class ReferenceTracer::SolidWalk : CellWalk {
 public:
  SolidWalk(const ReferenceTracer& map, const TextureRay& ray) : CellWalk(map, ray, 1, -1) {}

  [[nodiscard]] ReferenceHit trace();

 private:
  /// How far the ray is over the upper surface and under the lower one, on its way through a cell.
  struct Gaps {
    Quadratic over;
    Quadratic under;
    [[nodiscard]] bool begin_inside() const { return over.f0 <= 0 && under.f0 <= 0; }
  };

  [[nodiscard]] static bool is_empty(const Bounds& bounds) { return bounds.min > bounds.max; }
  [[nodiscard]] bool is_beside(const Bounds& bounds) const {
    return is_empty(bounds) || height(t_next_) > static_cast<double>(bounds.max) ||
           height(t_) < static_cast<double>(bounds.min);
  }
  [[nodiscard]] Gaps gaps() const {
    return {.over = gap(corners(map_.corners_)), .under = gap(corners(map_.floors_)).negated()};
  }
  [[nodiscard]] double enter();
  [[nodiscard]] double leave(double t_enter);
};

double ReferenceTracer::SolidWalk::enter() {
  for (;;) {
    find_exit();
    const Bounds& here = bounds();
    const bool is_skipped = is_beside(here);
    if (level_ > 0 && !is_skipped) {
      const double t_highest = 1.0 - static_cast<double>(here.max);
      if (t_highest > t_) move_to(t_highest);
      descend();
      continue;
    }
    if (!is_skipped) {
      const Gaps here_gaps = gaps();
      if (here_gaps.begin_inside()) return t_;
      const double by_top = falling_root(here_gaps.over);
      const double by_floor = falling_root(here_gaps.under);
      double s = kPasses;
      if (by_top != kPasses && here_gaps.under.at(by_top) <= kRim) s = by_top;
      if (by_floor < s && here_gaps.over.at(by_floor) <= kRim) s = by_floor;
      if (s != kPasses) return t_ + s;
    }
    if (t_next_ == t_end_) return kPasses;
    advance(Climb::to_new_parent);
  }
}

double ReferenceTracer::SolidWalk::leave(double t_enter) {
  for (double from = t_enter - t_;; from = 0) {
    if (is_empty(bounds())) return t_;
    const Gaps here = gaps();
    const double s = std::min(rising_root(here.over, from), rising_root(here.under, from));
    if (s != kPasses) return t_ + s;
    if (t_next_ == t_end_) {
      if (t_end_ < 1) return t_end_;  // under the lowest floor
      return kPasses;
    }
    advance(Climb::never);
    find_exit();
  }
}

ReferenceHit ReferenceTracer::SolidWalk::trace() {
  constexpr ReferenceHit kNone{.t_enter = kPasses, .t_exit = kPasses};
  if (is_level() || is_empty(map_.bounds_)) return kNone;
  const double t_top = std::clamp(1.0 - static_cast<double>(map_.bounds_.max), 0.0, 1.0);
  begin(t_top, std::clamp(1.0 - static_cast<double>(map_.bounds_.min), t_top, 1.0));
  climb_to_travel();
  const double t_enter = enter();
  return t_enter == kPasses ? kNone : ReferenceHit{.t_enter = t_enter, .t_exit = leave(t_enter)};
}

ReferenceHit ReferenceTracer::trace_solid(const TextureRay& ray) const { return SolidWalk(*this, ray).trace(); }

void ReferenceTracer::build_solid(const Heightfield& heights) {
  const int border = wrap_ == Wrap::clamp ? 1 : 0;
  floors_.reserve(corners_.size());
  for (int y = 0; y <= cells_y_; ++y)
    for (int x = 0; x <= cells_x_; ++x)
      floors_.push_back(heights.floor_at(wrapped(x - border, width_, wrap_), wrapped(y - border, height_, wrap_)));
  Level level{.width = cells_x_, .nodes = {}};
  level.nodes.reserve(static_cast<std::size_t>(cells_x_) * static_cast<std::size_t>(cells_y_));
  const std::size_t stride = static_cast<std::size_t>(cells_x_) + 1;
  for (int y = 0; y < cells_y_; ++y)
    for (int x = 0; x < cells_x_; ++x) {
      const std::size_t first = static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x);
      Bounds bounds = kEmpty;
      bool has_solid = false;
      for (const std::size_t corner : {first, first + 1, first + stride, first + stride + 1}) {
        has_solid = has_solid || corners_[corner] > floors_[corner];
        bounds = {.min = std::min(bounds.min, floors_[corner]), .max = std::max(bounds.max, corners_[corner])};
      }
      level.nodes.push_back(has_solid ? bounds : kEmpty);
    }
  levels_.push_back(std::move(level));
}

}  // namespace reliefbench
