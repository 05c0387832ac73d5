#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/judge/quadratic.h"
#include "kernels/judge/ray_axis.h"
#include "kernels/judge/reference.h"

namespace reliefbench {

/// A ray on its way from node to node, z(t) = z + rise t, rise 1 or -1. Crossings are (edge - origin) / speed, never
/// accumulated, and t is carried, so the gap at a shared edge has the same bits on both sides: no ray slips through.
class ReferenceTracer::CellWalk {
 protected:
  enum class Entered { inside, by_x, by_y };
  /// Whether the walk goes on in the parent of the next node, which may be skipped whole.
  enum class Climb { never, to_new_parent, always };

  /// ray: TextureRay or RisingRay
  template <typename Ray>
  CellWalk(const ReferenceTracer& map, const Ray& ray, double z, double rise)
      : map_(map),
        x_(start_cell(static_cast<double>(ray.u), map.width_, map.wrap_), static_cast<double>(ray.slope_u) * map.width_,
           map.cells_x_, map.wrap_),
        y_(start_cell(static_cast<double>(ray.v), map.height_, map.wrap_),
           static_cast<double>(ray.slope_v) * map.height_, map.cells_y_, map.wrap_),
        z_(z),
        rise_(rise),
        top_level_(static_cast<int>(map.levels_.size()) - 1) {}

  [[nodiscard]] double travel() const { return std::max(std::abs(x_.speed), std::abs(y_.speed)); }
  /// As good as parallel to the plate (trace(), is_lit()): it has no way.
  [[nodiscard]] bool is_level() const {
    return !(travel() <= kMaxTravel) || !std::isfinite(x_.start) || !std::isfinite(y_.start);
  }
  /// To the cell at t, whose way ends at t_end.
  void begin(double t, double t_end) {
    t_ = t;
    t_end_ = t_end;
    x_.seek(t, map_.wrap_);
    y_.seek(t, map_.wrap_);
  }
  /// From the cell to its ancestor of the travel's width: wider ones are hardly ever skipped.
  void climb_to_travel() {
    level_ = std::min(top_level_, std::ilogb(std::max((t_end_ - t_) * travel(), 1.0)));
    x_.node >>= level_;
    y_.node >>= level_;
  }
  void find_exit() {
    const double tx = x_.exit(level_);
    const double ty = y_.exit(level_);
    leaves_by_x_ = tx <= ty;
    t_next_ = std::min(std::max(std::min(tx, ty), t_), t_end_);
  }
  [[nodiscard]] const Bounds& bounds() const {
    const Level& level = map_.levels_[static_cast<std::size_t>(level_)];
    return level.nodes[static_cast<std::size_t>(y_.node) * static_cast<std::size_t>(level.width) +
                       static_cast<std::size_t>(x_.node)];
  }
  /// On within the node.
  void move_to(double t) {
    t_ = t;
    entered_ = Entered::inside;
  }
  void descend() {
    --level_;
    x_.descend(level_, t_);
    y_.descend(level_, t_);
  }
  void advance(Climb climb) {
    t_ = t_next_;
    entered_ = leaves_by_x_ ? Entered::by_x : Entered::by_y;
    if (leaves_by_x_) {
      cross(x_, climb);
    } else {
      cross(y_, climb);
    }
  }
  /// The cell's, of `all`, which are laid out as ReferenceTracer::corners_.
  [[nodiscard]] Corners corners(const std::vector<float>& all) const {
    const std::size_t stride = static_cast<std::size_t>(map_.cells_x_) + 1;
    const float* row = &all[static_cast<std::size_t>(y_.node) * stride + static_cast<std::size_t>(x_.node)];
    return {row[0], row[1], row[stride], row[stride + 1]};
  }
  /// Height of the ray over the surface, on its way through the cell. Exact on the edges, where both neighbours see the
  /// same two corners.
  [[nodiscard]] Quadratic gap(const Corners& h) const {
    const double fx0 = entered_ == Entered::by_x ? 1 - x_.forward : x_.fraction(t_);
    const double fy0 = entered_ == Entered::by_y ? 1 - y_.forward : y_.fraction(t_);
    const bool at_edge = t_next_ < t_end_;
    const double fx1 = at_edge && leaves_by_x_ ? x_.forward : x_.fraction(t_next_);
    const double fy1 = at_edge && !leaves_by_x_ ? y_.forward : y_.fraction(t_next_);
    const double twist = (h.h00 - h.h10) + (h.h11 - h.h01);
    const double along_x = (h.h10 - h.h00) + twist * fy0;
    const double along_y = (h.h01 - h.h00) + twist * fx0;
    return {.f0 = height(t_) - h.at(fx0, fy0),
            .b = rise_ - (along_x * x_.speed + along_y * y_.speed),
            .a = -twist * x_.speed * y_.speed,
            .f1 = height(t_next_) - h.at(fx1, fy1),
            .length = t_next_ - t_};
  }
  [[nodiscard]] double height(double t) const { return z_ + rise_ * t; }

  const ReferenceTracer& map_;
  RayAxis x_;
  RayAxis y_;
  double z_;
  double rise_;
  double t_ = 0;       ///< entry of the node
  double t_next_ = 0;  ///< and exit
  double t_end_ = 1;
  int level_ = 0;
  int top_level_;
  bool leaves_by_x_ = false;
  Entered entered_ = Entered::inside;

 private:
  void cross(RayAxis& axis, Climb climb) {
    const bool new_parent = (axis.node & 1) == axis.forward;
    axis.cross(level_);
    if (climb == Climb::never || (climb == Climb::to_new_parent && !new_parent) || level_ == top_level_) return;
    ++level_;
    x_.node >>= 1;
    y_.node >>= 1;
  }
};

}  // namespace reliefbench
