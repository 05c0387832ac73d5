#include "kernels/trace/guarantee.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace reliefbench {

namespace {

/// The height of the ray at t over the bilinear surface of some texels of the map.
double gap_over(const std::vector<float>& texels, const Heightfield& map, Wrap wrap, const TextureRay& ray, double t) {
  const double x = (ray.u + ray.slope_u * t) * map.width - 0.5;
  const double y = (ray.v + ray.slope_v * t) * map.height - 0.5;
  const double cell_x = std::floor(x);
  const double cell_y = std::floor(y);
  // Only where the ray is in the map matters for the texel, so that far tiles do not overflow an int.
  const int left = wrap == Wrap::repeat ? static_cast<int>(std::fmod(cell_x, map.width))
                                        : static_cast<int>(std::fmin(std::fmax(cell_x, -1), map.width));
  const int top = wrap == Wrap::repeat ? static_cast<int>(std::fmod(cell_y, map.height))
                                       : static_cast<int>(std::fmin(std::fmax(cell_y, -1), map.height));
  const auto texel = [&](int dx, int dy) {
    return static_cast<double>(
        texels[map.index(wrapped(left + dx, map.width, wrap), wrapped(top + dy, map.height, wrap))]);
  };
  const double upper = std::lerp(texel(0, 0), texel(1, 0), x - cell_x);
  const double lower = std::lerp(texel(0, 1), texel(1, 1), x - cell_x);
  return 1 - t - std::lerp(upper, lower, y - cell_y);
}

}  // namespace

double gap_above(const Heightfield& surface, Wrap wrap, const TextureRay& ray, double t) {
  const double over = gap_over(surface.texels, surface, wrap, ray, t);
  return surface.is_solid() ? std::max(over, -gap_over(surface.floors, surface, wrap, ray, t)) : over;
}

Kept keeps(Guarantee guarantee, const ScorePixel& pixel, const PixelScore& score, const ReferenceHit& reference,
           const Heightfield& surface, Wrap wrap) {
  if (guarantee == Guarantee::none) return Kept::yes;
  if (score.verdict == Verdict::missed)
    return reference.t_exit - reference.t_enter < kThinnestSolid ? Kept::unresolved : Kept::no;
  const bool is_capped = pixel.status == static_cast<float>(PixelStatus::step_cap);
  if (score.verdict == Verdict::false_kill)
    return reference.t_exit - reference.t_enter < kThinnestSolid ? Kept::unresolved : Kept::no;
  if (score.verdict == Verdict::false_keep && guarantee == Guarantee::exact && !is_capped)
    return gap_above(surface, wrap, pixel.ray, pixel.t) < kNearestGap ? Kept::unresolved : Kept::no;
  if (guarantee != Guarantee::exact || score.verdict != Verdict::unconverged || is_capped) return Kept::yes;
  return gap_above(surface, wrap, pixel.ray, pixel.t) < kNearestGap ? Kept::unresolved : Kept::no;
}

namespace {

constexpr double kBentBlur = 1e-5;  ///< of height, for each texel of the way and as much of the bend

/// The t at which a coordinate of the grid next is a whole number.
double next_border(double start, double speed, double t) {
  if (speed == 0) return std::numeric_limits<double>::infinity();
  const double x = start + speed * t;
  const double border = speed > 0 ? std::floor(x) + 1 : std::ceil(x) - 1;
  const double next = (border - start) / speed;
  return next > t ? next : std::nextafter(t, std::numeric_limits<double>::infinity());
}

}  // namespace

Kept keeps_bent(Guarantee guarantee, const ScorePixel& pixel, double bend, const Heightfield& surface, Wrap wrap) {
  if (guarantee == Guarantee::none) return Kept::yes;
  const auto t_end = static_cast<double>(pixel.t);
  const double travel_u = static_cast<double>(pixel.ray.slope_u) * surface.width;
  const double travel_v = static_cast<double>(pixel.ray.slope_v) * surface.height;
  const double blur = kBentBlur * (1 + std::hypot(travel_u, travel_v) * t_end + std::abs(bend) * t_end * t_end);
  const double x = static_cast<double>(pixel.ray.u) * surface.width - 0.5;
  const double y = static_cast<double>(pixel.ray.v) * surface.height - 0.5;
  const auto gap = [&](double t) { return gap_above(surface, wrap, pixel.ray, t) + bend * t * t; };
  double least = gap(0);
  // Within a cell the gap is a parabola: three of its points tell the lowest.
  for (double t = 0; t < t_end;) {
    const double next = std::min({next_border(x, travel_u, t), next_border(y, travel_v, t), t_end});
    const double a = gap(t);
    const double b = gap(0.5 * (t + next));
    const double c = next < t_end ? gap(next) : b;
    const double curve = 2 * (a + c - 2 * b);
    const double slope = 4 * b - 3 * a - c;
    const double at = curve > 0 ? -slope / (2 * curve) : 0;
    least = std::min(least, b);
    if (at > 0 && at < 1) least = std::min(least, a + slope * at + curve * at * at);
    if (next < t_end) least = std::min(least, c);
    t = next;
  }
  if (t_end > 0 && least < -blur) return Kept::no;
  const bool is_hit = pixel.status == static_cast<float>(PixelStatus::hit);
  if (guarantee == Guarantee::exact && is_hit && gap(t_end) > blur) return Kept::no;
  return Kept::yes;
}

}  // namespace reliefbench
