#include "kernels/judge/reference.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/judge/quadratic.h"
#include "kernels/judge/ray_axis.h"

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
  const bool dips = f.a > 0 && f.b < 0 && -f.b < 2 * f.a * f.length;
  if (!crossed && !dips) return {};
  const double disc = discriminant(f);
  if (!crossed && disc < 0) return {};
  const double root = std::sqrt(std::max(disc, 0.0));
  const double s = f.b <= 0 ? 2 * f.f0 / (root - f.b) : (f.b + root) / (-2 * f.a);
  // Also where rounding made 0/0 or a root just beyond the end.
  return {s < f.length ? s : f.length, -root};
}

}  // namespace

/// A ray on its way from cell to cell. Crossings are (edge - origin) / speed, never accumulated, and t is carried, so
/// the F of a shared edge has the same bits on both sides: no ray slips through.
class ReferenceTracer::Walk {
 public:
  Walk(const ReferenceTracer& map, const TextureRay& ray)
      : map_(map),
        x_(start_cell(static_cast<double>(ray.u), map.width_, map.wrap_), static_cast<double>(ray.slope_u) * map.width_,
           map.cells_x_, map.wrap_),
        y_(start_cell(static_cast<double>(ray.v), map.height_, map.wrap_),
           static_cast<double>(ray.slope_v) * map.height_, map.cells_y_, map.wrap_) {}

  [[nodiscard]] double enter();  ///< t_enter; the walk then stands in the hit cell
  [[nodiscard]] double leave();  ///< t_exit of what enter() has found

 private:
  enum class Entered { inside, by_x, by_y };

  template <bool kSolid>
  [[nodiscard]] double find();
  template <bool kSolid>
  [[nodiscard]] bool can_skip(const Bounds& bounds) const;
  template <bool kSolid>
  [[nodiscard]] Root solve();
  template <bool kSolid>
  void advance();
  template <bool kSolid>
  void step(RayAxis& crossed);
  [[nodiscard]] double exit_in_hit_cell() const;

  const ReferenceTracer& map_;
  RayAxis x_;
  RayAxis y_;
  double t_ = 0;       ///< entry of the node
  double t_next_ = 0;  ///< and exit
  double t_end_ = 1;   ///< at the lowest texel
  int level_ = 0;
  int top_level_ = 0;
  bool leaves_by_x_ = false;
  bool in_hit_cell_ = false;  ///< enter() has found a crossing
  Entered entered_ = Entered::inside;
  Quadratic cell_{};  ///< of the last solved cell
  Root root_;         ///< and where the ray entered or left the solid in it
};

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
    return;
  }
  const auto [low, high] = std::minmax_element(heights.texels.begin(), heights.texels.end());
  bounds_ = {*low, *high};
  build_levels();
}

void ReferenceTracer::build_levels() {
  levels_.resize(1);
  for (int level = 1;; ++level) {
    const int width = ((cells_x_ - 1) >> level) + 1;
    const int height = ((cells_y_ - 1) >> level) + 1;
    Level next{.width = width, .nodes = {}};
    next.nodes.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    // A node of level 1 is 2x2 cells, so 3x3 corners; above, 2x2 nodes.
    const bool from_corners = level == 1;
    const int reach = from_corners ? 2 : 1;
    const int last_x = from_corners ? cells_x_ : (cells_x_ - 1) >> (level - 1);
    const int last_y = from_corners ? cells_y_ : (cells_y_ - 1) >> (level - 1);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        Bounds bounds{std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest()};
        for (int j = 2 * y; j <= std::min(2 * y + reach, last_y); ++j) {
          for (int i = 2 * x; i <= std::min(2 * x + reach, last_x); ++i) {
            const std::size_t row = static_cast<std::size_t>(j) * static_cast<std::size_t>(last_x + 1);
            const std::size_t index = row + static_cast<std::size_t>(i);
            const Bounds part = from_corners ? Bounds{corners_[index], corners_[index]} : levels_.back().nodes[index];
            bounds = {std::min(bounds.min, part.min), std::max(bounds.max, part.max)};
          }
        }
        next.nodes.push_back(bounds);
      }
    }
    levels_.push_back(std::move(next));
    if (width == 1 && height == 1) return;
  }
}

template <bool kSolid>
bool ReferenceTracer::Walk::can_skip(const Bounds& bounds) const {
  return kSolid ? 1 - t_ <= bounds.min : 1 - t_next_ > bounds.max;
}

/// Where the ray enters (kSolid: leaves) the solid in this cell.
template <bool kSolid>
Root ReferenceTracer::Walk::solve() {
  const std::size_t stride = static_cast<std::size_t>(map_.cells_x_) + 1;
  const float* row = &map_.corners_[static_cast<std::size_t>(y_.node) * stride + static_cast<std::size_t>(x_.node)];
  const Bounds low{std::min(row[0], row[1]), std::max(row[0], row[1])};
  const Bounds high{std::min(row[stride], row[stride + 1]), std::max(row[stride], row[stride + 1])};
  if (can_skip<kSolid>({std::min(low.min, high.min), std::max(low.max, high.max)})) return {};

  const double h00 = row[0], h10 = row[1], h01 = row[stride], h11 = row[stride + 1];
  // Exact on the edges, where both neighbours see the same two corners.
  const auto above = [&](double t, double fx, double fy) {
    return (1 - t) - ((h00 * (1 - fx) + h10 * fx) * (1 - fy) + (h01 * (1 - fx) + h11 * fx) * fy);
  };
  const double fx0 = entered_ == Entered::by_x ? 1 - x_.forward : x_.fraction(t_);
  const double fy0 = entered_ == Entered::by_y ? 1 - y_.forward : y_.fraction(t_);
  const bool at_edge = t_next_ < t_end_;
  const double fx1 = at_edge && leaves_by_x_ ? x_.forward : x_.fraction(t_next_);
  const double fy1 = at_edge && !leaves_by_x_ ? y_.forward : y_.fraction(t_next_);
  const double twist = (h00 - h10) + (h11 - h01);
  const double along_x = (h10 - h00) + twist * fy0;
  const double along_y = (h01 - h00) + twist * fx0;
  cell_ = {.f0 = above(t_, fx0, fy0),
           .b = -1 - (along_x * x_.speed + along_y * y_.speed),
           .a = -twist * x_.speed * y_.speed,
           .f1 = above(t_next_, fx1, fy1),
           .length = t_next_ - t_};
  if (kSolid ? cell_.f0 > 0 : cell_.f0 <= 0) return {.s = 0, .slope = cell_.b};
  return kSolid ? first_root(cell_.negated(), cell_.f1 > 0) : first_root(cell_, cell_.f1 <= 0);
}

template <bool kSolid>
void ReferenceTracer::Walk::step(RayAxis& crossed) {
  // Out of the parent too, which may be skipped whole. In the solid it may be even when it was not before.
  const bool new_parent = (crossed.node & 1) == crossed.forward;
  crossed.cross(level_);
  if ((kSolid || new_parent) && level_ < top_level_) {
    ++level_;
    x_.node >>= 1;
    y_.node >>= 1;
  }
}

template <bool kSolid>
void ReferenceTracer::Walk::advance() {
  t_ = t_next_;
  entered_ = leaves_by_x_ ? Entered::by_x : Entered::by_y;
  if (leaves_by_x_) {
    step<kSolid>(x_);
  } else {
    step<kSolid>(y_);
  }
}

/// t of the next crossing of the surface, kNever if there is none down to the lowest texel.
template <bool kSolid>
double ReferenceTracer::Walk::find() {
  for (;;) {
    const double tx = x_.exit(level_);
    const double ty = y_.exit(level_);
    leaves_by_x_ = tx <= ty;
    t_next_ = std::min(std::max(std::min(tx, ty), t_), t_end_);
    if (level_ > 0) {
      const Level& level = map_.levels_[static_cast<std::size_t>(level_)];
      const std::size_t row = static_cast<std::size_t>(y_.node) * static_cast<std::size_t>(level.width);
      const Bounds& bounds = level.nodes[row + static_cast<std::size_t>(x_.node)];
      if (!can_skip<kSolid>(bounds)) {
        if (!kSolid && 1.0 - bounds.max > t_) {
          t_ = 1.0 - bounds.max;
          entered_ = Entered::inside;
        }
        --level_;
        x_.descend(level_, t_);
        y_.descend(level_, t_);
        continue;
      }
    } else {
      root_ = solve<kSolid>();
      if (root_.s != kNever) return t_ + root_.s;
    }
    if (t_next_ == t_end_) return kNever;
    advance<kSolid>();
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
  t_ = std::clamp(1.0 - map_.bounds_.max, 0.0, 1.0);
  t_end_ = std::clamp(1.0 - map_.bounds_.min, t_, 1.0);
  const double travel = std::max(std::abs(x_.speed), std::abs(y_.speed));
  if (!(travel <= kMaxTravel) || !std::isfinite(x_.start) || !std::isfinite(y_.start)) return t_;

  // seek() finds the cell; its ancestor is the node to begin with.
  x_.seek(t_, map_.wrap_);
  y_.seek(t_, map_.wrap_);
  top_level_ = static_cast<int>(map_.levels_.size()) - 1;
  // A node as wide as the whole travel is hardly ever skipped.
  level_ = std::min(top_level_, std::ilogb(std::max((t_end_ - t_) * travel, 1.0)));
  x_.node >>= level_;
  y_.node >>= level_;
  const double t_enter = find<false>();
  in_hit_cell_ = t_enter != kNever;
  return in_hit_cell_ ? t_enter : t_end_;  // else at the lowest texel, up to rounding
}

double ReferenceTracer::Walk::leave() {
  if (!in_hit_cell_) return kNever;
  const double t_exit = exit_in_hit_cell();
  if (t_exit != kNever || t_next_ == t_end_) return t_exit;
  advance<true>();
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
