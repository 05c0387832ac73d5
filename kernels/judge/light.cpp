#include "kernels/judge/light.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "kernels/base/parallel.h"
#include "kernels/judge/cell_walk.h"

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

/// A ray on its way up. Nodes that it has risen over are skipped.
class ReferenceTracer::LightWalk : CellWalk {
 public:
  LightWalk(const ReferenceTracer& map, const RisingRay& ray) : CellWalk(map, ray, ray.z, 1), lift_(ray.lift) {}

  [[nodiscard]] bool is_lit();

 private:
  [[nodiscard]] bool is_blocked() const;

  double lift_;
};

/// Whether this cell's surface stands over the ray, at the least gap on its way through.
bool ReferenceTracer::LightWalk::is_blocked() const {
  const Quadratic f = gap(corners(map_.corners_));
  const double least = f.dips() ? f.f0 - f.b * f.b / (4 * f.a) : f.f1;
  return std::min(f.f0, std::min(f.f1, least)) < -kTouch;
}

bool ReferenceTracer::LightWalk::is_lit() {
  if (is_level()) return false;
  begin(0, 0);
  z_ = std::max(corners(map_.corners_).at(x_.fraction(0), y_.fraction(0)), z_) + lift_;
  t_end_ = static_cast<double>(map_.bounds_.max) - z_;
  if (t_end_ <= 0) return true;

  for (;;) {
    find_exit();
    if (level_ == 0) {
      if (is_blocked()) return false;
    } else if (height(t_) < static_cast<double>(bounds().max)) {
      descend();
      continue;
    }
    if (t_next_ == t_end_) return true;
    advance(Climb::to_new_parent);
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
