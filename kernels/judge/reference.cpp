#include "kernels/judge/reference.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/judge/cell_walk.h"

namespace reliefbench {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// The first crossing from above to below. Needs f0 >= 0.
/// crossed: f1 is on the far side, so a root exists whatever rounding does to the coefficients
/// returns: s in [0, length] and F'(s) = -sqrt(disc), or s = kNever
struct Root {
  double s = kNever;
  double slope = 0;
};
Root first_root(const Quadratic& f, bool crossed) {
  if (!crossed && !f.dips()) return {};
  const double disc = discriminant(f);
  if (!crossed && disc < 0) return {};
  const double root = std::sqrt(std::max(disc, 0.0));
  return {falling_zero(f, root), -root};
}

}  // namespace

/// A ray on its way down, to where it enters the surface and to where it leaves it again.
class ReferenceTracer::Walk : CellWalk {
 public:
  Walk(const ReferenceTracer& map, const TextureRay& ray) : CellWalk(map, ray, 1, -1) {}

  [[nodiscard]] double enter();  ///< t_enter; the walk then stands in the hit cell
  [[nodiscard]] double leave();  ///< t_exit of what enter() has found

 private:
  /// In the solid, a parent may be skipped that was not before.
  template <bool kSolid>
  static constexpr Climb kClimb = kSolid ? Climb::always : Climb::to_new_parent;

  template <bool kSolid>
  [[nodiscard]] double find();
  template <bool kSolid>
  [[nodiscard]] bool can_skip(const HeightRange& heights) const;
  template <bool kSolid>
  [[nodiscard]] Root solve();
  [[nodiscard]] double exit_in_hit_cell() const;

  bool in_hit_cell_ = false;  ///< enter() has found a crossing
  Quadratic cell_{};          ///< the gap in the last solved cell
  Root root_;                 ///< and where the ray entered or left the solid in it
};

/// Nodes over 2x2 of what is finer, width x height of it; over 3x3 of corners, which neighbours share.
template <typename Fine>
ReferenceTracer::Level ReferenceTracer::coarser(int width, int height, int reach, const Fine& fine) {
  Level level{.width = (width - reach) / 2 + 1, .nodes = {}};
  const int rows = (height - reach) / 2 + 1;
  level.nodes.reserve(static_cast<std::size_t>(level.width) * static_cast<std::size_t>(rows));
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < level.width; ++x) {
      Bounds bounds = kEmpty;
      for (int j = 2 * y; j <= std::min(2 * y + reach, height - 1); ++j) {
        for (int i = 2 * x; i <= std::min(2 * x + reach, width - 1); ++i) {
          const Bounds part =
              fine(static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i));
          bounds = {std::min(bounds.min, part.min), std::max(bounds.max, part.max)};
        }
      }
      level.nodes.push_back(bounds);
    }
  }
  return level;
}

ReferenceTracer::ReferenceTracer(const Heightfield& heights, Wrap wrap)
    : wrap_(wrap),
      width_(heights.width),
      height_(heights.height),
      cells_x_(heights.width + (wrap == Wrap::clamp ? 1 : 0)),
      cells_y_(heights.height + (wrap == Wrap::clamp ? 1 : 0)) {
  if (width_ < 2 || height_ < 2) fail_input("heightmap is {}x{}: at least 2x2 texels expected", width_, height_);
  const int border = wrap == Wrap::clamp ? 1 : 0;
  corners_.reserve(static_cast<std::size_t>(cells_x_ + 1) * static_cast<std::size_t>(cells_y_ + 1));
  for (int y = 0; y <= cells_y_; ++y) {
    for (int x = 0; x <= cells_x_; ++x) {
      corners_.push_back(heights.at(wrapped(x - border, width_, wrap), wrapped(y - border, height_, wrap)));
    }
  }
  if (heights.is_solid()) {
    build_solid(heights);
  } else {
    levels_.resize(1);
    levels_.push_back(coarser(cells_x_ + 1, cells_y_ + 1, 2, [&](std::size_t i) {
      return Bounds{corners_[i], corners_[i]};
    }));
  }
  while (levels_.back().nodes.size() > 1) {
    const Level& below = levels_.back();
    const int below_height = static_cast<int>(below.nodes.size()) / below.width;
    levels_.push_back(coarser(below.width, below_height, 1, [&](std::size_t i) { return below.nodes[i]; }));
  }
  bounds_ = levels_.back().nodes.front();
}

template <bool kSolid>
bool ReferenceTracer::Walk::can_skip(const HeightRange& heights) const {
  return kSolid ? height(t_) <= heights.min : height(t_next_) > heights.max;
}

/// Where the ray enters (kSolid: leaves) the solid in this cell.
template <bool kSolid>
Root ReferenceTracer::Walk::solve() {
  const Corners h = corners(map_.corners_);
  if (can_skip<kSolid>(h.range())) return {};
  cell_ = gap(h);
  if (kSolid ? cell_.f0 > 0 : cell_.f0 <= 0) return {.s = 0, .slope = cell_.b};
  return kSolid ? first_root(cell_.negated(), cell_.f1 > 0) : first_root(cell_, cell_.f1 <= 0);
}

/// t of the next crossing of the surface, kNever if there is none down to the lowest texel.
template <bool kSolid>
double ReferenceTracer::Walk::find() {
  for (;;) {
    find_exit();
    if (level_ > 0) {
      const Bounds& here = bounds();
      if (!can_skip<kSolid>({here.min, here.max})) {
        if (!kSolid && 1.0 - here.max > t_) move_to(1.0 - here.max);
        descend();
        continue;
      }
    } else {
      root_ = solve<kSolid>();
      if (root_.s != kNever) return t_ + root_.s;
    }
    if (t_next_ == t_end_) return kNever;
    advance(kClimb<kSolid>);
  }
}

/// The end of the solid interval that begins at root_, if it is in the same cell; from there F = s (slope + a s), so
/// the entry itself cannot be found again.
double ReferenceTracer::Walk::exit_in_hit_cell() const {
  if (root_.slope > 0 || (root_.slope == 0 && cell_.a > 0)) return t_ + root_.s;
  if (cell_.a <= 0) return kNever;
  const double s = root_.s - root_.slope / cell_.a;
  return s < cell_.length ? t_ + s : kNever;
}

double ReferenceTracer::Walk::enter() {
  const double t_top = std::clamp(1.0 - map_.bounds_.max, 0.0, 1.0);
  if (is_level()) return t_top;
  begin(t_top, std::clamp(1.0 - map_.bounds_.min, t_top, 1.0));
  climb_to_travel();
  const double t_enter = find<false>();
  in_hit_cell_ = t_enter != kNever;
  return in_hit_cell_ ? t_enter : t_end_;  // else at the lowest texel, up to rounding
}

double ReferenceTracer::Walk::leave() {
  if (!in_hit_cell_) return kNever;
  const double t_exit = exit_in_hit_cell();
  if (t_exit != kNever || t_next_ == t_end_) return t_exit;
  advance(kClimb<true>);
  return find<true>();
}

double ReferenceTracer::first_hit(const TextureRay& ray) const {
  return floors_.empty() ? Walk(*this, ray).enter() : trace(ray).t_enter;
}

ReferenceHit ReferenceTracer::trace(const TextureRay& ray) const {
  if (!floors_.empty()) return trace_solid(ray);
  Walk walk(*this, ray);
  const double t_enter = walk.enter();
  return {.t_enter = t_enter, .t_exit = walk.leave()};
}

std::vector<ReferenceHit> ReferenceTracer::trace(std::span<const TextureRay> rays, int threads) const {
  constexpr std::size_t kTile = 1024;
  std::vector<ReferenceHit> hits(rays.size());
  parallel_for(static_cast<int>((rays.size() + kTile - 1) / kTile), threads, [&](int tile) {
    const std::size_t first = static_cast<std::size_t>(tile) * kTile;
    const std::size_t last = std::min(first + kTile, rays.size());
    for (std::size_t i = first; i < last; ++i) hits[i] = trace(rays[i]);
  });
  return hits;
}

}  // namespace reliefbench
