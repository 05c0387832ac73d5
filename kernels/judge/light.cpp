#include "kernels/judge/light.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "kernels/base/parallel.h"
#include "kernels/judge/ray_axis.h"

namespace reliefbench {
namespace {

using Vector = std::array<double, 3>;

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// A point of the unit square as one of the unit disc; parts of equal area stay so.
/// source: Shirley and Chiu, A Low Distortion Map Between Disk and Square, 1997
std::array<double, 2> on_disc(double x, double y) {
  const double a = 2 * x - 1;
  const double b = 2 * y - 1;
  if (a == 0 && b == 0) return {0, 0};
  const bool is_wide = std::abs(a) > std::abs(b);
  const double radius = is_wide ? a : b;
  const double angle = is_wide ? std::numbers::pi / 4 * (b / a) : std::numbers::pi / 2 - std::numbers::pi / 4 * (a / b);
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

}  // namespace

/// A ray on its way up from cell to cell, as Walk goes down. Nodes that it has risen over are skipped.
class ReferenceTracer::LightWalk {
 public:
  LightWalk(const ReferenceTracer& map, const RisingRay& ray)
      : map_(map),
        x_(start_cell(ray.u, map.width_, map.wrap_), ray.slope_u * map.width_, map.cells_x_, map.wrap_),
        y_(start_cell(ray.v, map.height_, map.wrap_), ray.slope_v * map.height_, map.cells_y_, map.wrap_),
        begin_z_(ray.z),
        lift_(ray.lift) {}

  [[nodiscard]] bool is_lit();

 private:
  enum class Entered { inside, by_x, by_y };

  struct Corners {
    double h00, h10, h01, h11;
    [[nodiscard]] double at(double fx, double fy) const {
      return (h00 * (1 - fx) + h10 * fx) * (1 - fy) + (h01 * (1 - fx) + h11 * fx) * fy;
    }
  };
  [[nodiscard]] Corners corners() const;
  [[nodiscard]] bool is_over(const Bounds& bounds) const { return z_ + s_ >= static_cast<double>(bounds.max); }
  [[nodiscard]] bool is_blocked() const;
  void advance();

  const ReferenceTracer& map_;
  RayAxis x_;
  RayAxis y_;
  double begin_z_;  ///< RisingRay::z
  double lift_;
  double z_ = 0;       ///< height where the ray begins
  double s_ = 0;       ///< entry of the node
  double s_next_ = 0;  ///< and exit
  double s_end_ = 0;   ///< at the highest texel
  int level_ = 0;
  int top_level_ = 0;
  bool leaves_by_x_ = false;
  Entered entered_ = Entered::inside;
};

ReferenceTracer::LightWalk::Corners ReferenceTracer::LightWalk::corners() const {
  const std::size_t stride = static_cast<std::size_t>(map_.cells_x_) + 1;
  const float* row = &map_.corners_[static_cast<std::size_t>(y_.node) * stride + static_cast<std::size_t>(x_.node)];
  return {row[0], row[1], row[stride], row[stride + 1]};
}

/// Whether this cell's surface stands over the ray: the least of f(s) = f0 + b s + a s^2 on its way through.
bool ReferenceTracer::LightWalk::is_blocked() const {
  const Corners h = corners();
  const double fx0 = entered_ == Entered::by_x ? 1 - x_.forward : x_.fraction(s_);
  const double fy0 = entered_ == Entered::by_y ? 1 - y_.forward : y_.fraction(s_);
  const bool at_edge = s_next_ < s_end_;
  const double fx1 = at_edge && leaves_by_x_ ? x_.forward : x_.fraction(s_next_);
  const double fy1 = at_edge && !leaves_by_x_ ? y_.forward : y_.fraction(s_next_);
  const double twist = (h.h00 - h.h10) + (h.h11 - h.h01);
  const double f0 = z_ + s_ - h.at(fx0, fy0);
  const double f1 = z_ + s_next_ - h.at(fx1, fy1);
  const double b = 1 - ((h.h10 - h.h00 + twist * fy0) * x_.speed + (h.h01 - h.h00 + twist * fx0) * y_.speed);
  const double a = -twist * x_.speed * y_.speed;
  const bool dips = a > 0 && b < 0 && -b < 2 * a * (s_next_ - s_);
  return std::min(std::min(f0, f1), dips ? f0 - b * b / (4 * a) : f1) < -kTouch;
}

void ReferenceTracer::LightWalk::advance() {
  s_ = s_next_;
  entered_ = leaves_by_x_ ? Entered::by_x : Entered::by_y;
  RayAxis& crossed = leaves_by_x_ ? x_ : y_;
  const bool new_parent = (crossed.node & 1) == crossed.forward;
  crossed.cross(level_);
  if (!new_parent || level_ == top_level_) return;
  ++level_;
  x_.node >>= 1;
  y_.node >>= 1;
}

bool ReferenceTracer::LightWalk::is_lit() {
  const double travel = std::max(std::abs(x_.speed), std::abs(y_.speed));
  if (!(travel <= kMaxTravel) || !std::isfinite(x_.start) || !std::isfinite(y_.start)) return false;
  x_.seek(0, map_.wrap_);
  y_.seek(0, map_.wrap_);
  z_ = std::max(corners().at(x_.fraction(0), y_.fraction(0)), begin_z_) + lift_;
  s_end_ = static_cast<double>(map_.bounds_.max) - z_;
  if (s_end_ <= 0) return true;

  top_level_ = static_cast<int>(map_.levels_.size()) - 1;
  for (;;) {
    const double sx = x_.exit(level_);
    const double sy = y_.exit(level_);
    leaves_by_x_ = sx <= sy;
    s_next_ = std::min(std::max(std::min(sx, sy), s_), s_end_);
    if (level_ == 0) {
      if (is_blocked()) return false;
    } else {
      const Level& level = map_.levels_[static_cast<std::size_t>(level_)];
      const std::size_t row = static_cast<std::size_t>(y_.node) * static_cast<std::size_t>(level.width);
      if (!is_over(level.nodes[row + static_cast<std::size_t>(x_.node)])) {
        --level_;
        x_.descend(level_, s_);
        y_.descend(level_, s_);
        continue;
      }
    }
    if (s_next_ == s_end_) return true;
    advance();
  }
}

bool ReferenceTracer::is_lit(const RisingRay& ray) const { return LightWalk(*this, ray).is_lit(); }

std::vector<Vector> light_directions(const LightSource& light) {
  const Vector& middle = light.direction;
  if (light.radius == 0) return {middle};
  // Two directions across: the first is level, whatever the light's height.
  const double level = std::hypot(middle[0], middle[1]);
  const Vector across = level > 0 ? Vector{-middle[1] / level, middle[0] / level, 0} : Vector{1, 0, 0};
  const Vector up = cross(middle, across);
  std::vector<Vector> directions;
  for (int j = 0; j < kLightStrata; ++j)
    for (int i = 0; i < kLightStrata; ++i) {
      const auto [x, y] = on_disc((i + 0.5) / kLightStrata, (j + 0.5) / kLightStrata);
      Vector& towards = directions.emplace_back(middle);
      for (std::size_t axis = 0; axis < 3; ++axis)
        towards.at(axis) += light.radius * (x * across.at(axis) + y * up.at(axis));
    }
  return directions;
}

std::vector<RisingRay> light_rays(const LightSource& light, double u, double v) {
  std::vector<RisingRay> rays;
  for (const Vector& towards : light_directions(light))
    if (towards[2] > 0)
      rays.push_back({.u = u,
                      .v = v,
                      .slope_u = towards[0] / towards[2] * light.relief_depth,
                      .slope_v = towards[1] / towards[2] * light.relief_depth});
  return rays;
}

std::vector<float> exact_light(const ReferenceTracer& tracer, const LightSource& light,
                               std::span<const TextureRay> rays, std::span<const ReferenceHit> hits, int threads) {
  assert(rays.size() == hits.size());
  constexpr std::size_t kTile = 256;
  const double directions = light.radius == 0 ? 1 : kLightStrata * kLightStrata;
  std::vector<RisingRay> towards = light_rays(light, 0, 0);  // alike for all hits but for where they begin
  std::vector<float> shares(rays.size());
  parallel_for(static_cast<int>((rays.size() + kTile - 1) / kTile), threads, [&](int tile) {
    const std::size_t first = static_cast<std::size_t>(tile) * kTile;
    for (std::size_t i = first; i < std::min(first + kTile, rays.size()); ++i) {
      const double t = hits[i].t_enter;
      const double u = static_cast<double>(rays[i].u) + static_cast<double>(rays[i].slope_u) * t;
      const double v = static_cast<double>(rays[i].v) + static_cast<double>(rays[i].slope_v) * t;
      const auto lit = std::ranges::count_if(towards, [&](const RisingRay& ray) {
        return tracer.is_lit({.u = u, .v = v, .slope_u = ray.slope_u, .slope_v = ray.slope_v});
      });
      shares[i] = static_cast<float>(static_cast<double>(lit) / directions);
    }
  });
  return shares;
}

std::int64_t falsely_lit(const ReferenceTracer& tracer, const LightSource& light, int map_width, int map_height,
                         std::span<const ScorePixel> pixels, std::span<const float> shares) {
  std::int64_t count = 0;
  const std::vector<RisingRay> towards =
      light_rays({.direction = light.direction, .relief_depth = light.relief_depth}, 0, 0);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const ScorePixel& pixel = pixels[i];
    if (pixel.status == static_cast<float>(PixelStatus::no_ray) || shares[i] <= 0) continue;
    if (towards.empty()) {
      ++count;
      continue;
    }
    const auto t = static_cast<double>(pixel.t);
    RisingRay ray = towards.front();
    ray.u = static_cast<double>(pixel.ray.u) + static_cast<double>(pixel.ray.slope_u) * t;
    ray.v = static_cast<double>(pixel.ray.v) + static_cast<double>(pixel.ray.slope_v) * t;
    ray.z = 1 - t;
    const double texels = map_width * (std::abs(ray.u) + std::abs(ray.slope_u) * t) +
                          map_height * (std::abs(ray.v) + std::abs(ray.slope_v) * t);
    ray.lift = kFloatLift * (1 + texels);
    if (!tracer.is_lit(ray)) ++count;
  }
  return count;
}

}  // namespace reliefbench
