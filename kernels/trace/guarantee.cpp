#include "kernels/trace/guarantee.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace reliefbench {

namespace {

/// Where a ray is, in texels from the middle of the first one; unwrapped.
struct PlaceInMap {
  double x;
  double y;
};

PlaceInMap place_at(const Heightfield& map, const TextureRay& ray, double t) {
  return {(ray.u + ray.slope_u * t) * map.width - 0.5, (ray.v + ray.slope_v * t) * map.height - 0.5};
}

/// A cell's lower texel on one axis, near enough to the map that far tiles do not overflow an int.
int lower_texel(double cell, int side, Wrap wrap) {
  return static_cast<int>(wrap == Wrap::repeat ? std::fmod(cell, side) : std::clamp<double>(cell, -1, side));
}

/// The texels of a cell, by row and column.
struct CellTexels {
  std::array<std::array<double, 2>, 2> at;
};

CellTexels cell_texels(const std::vector<float>& texels, const Heightfield& map, Wrap wrap, double cell_x,
                       double cell_y) {
  const int left = lower_texel(cell_x, map.width, wrap);
  const int top = lower_texel(cell_y, map.height, wrap);
  const auto texel = [&](int dx, int dy) {
    return static_cast<double>(
        texels[map.index(wrapped(left + dx, map.width, wrap), wrapped(top + dy, map.height, wrap))]);
  };
  return {{{{texel(0, 0), texel(1, 0)}, {texel(0, 1), texel(1, 1)}}}};
}

/// The height of the ray at t over the bilinear surface of some texels of the map.
double gap_over(const std::vector<float>& texels, const Heightfield& map, Wrap wrap, const TextureRay& ray, double t) {
  const PlaceInMap at = place_at(map, ray, t);
  const double cell_x = std::floor(at.x);
  const double cell_y = std::floor(at.y);
  const auto [rows] = cell_texels(texels, map, wrap, cell_x, cell_y);
  const auto along = [&](const std::array<double, 2>& row) { return std::lerp(row[0], row[1], at.x - cell_x); };
  return 1 - t - std::lerp(along(rows[0]), along(rows[1]), at.y - cell_y);
}

/// In float a ray at t is up to 11 roundings of 2^-24 from its true place: of the origin (its product with the side,
/// the half texel, 1 of the sum), of the slope times t (2), of the border it came over, divided to 2.5 ulp as Vulkan
/// allows, and of the last t. So much of its way and of its origin, rounded up to a power of two.
constexpr double kPlaceRounding = 0x1p-20;

double place_blur(double origin, double place) {
  return kPlaceRounding * (std::abs(origin) + std::abs(place - origin));
}

/// How far a float's place may lift the surface under a ray: a solver goes on along its cell's surface as far beyond
/// the border as the place is wrong, over a crest by the difference of two texels each texel. At most 1, all heights'
/// range.
double lift_of_rounding(const std::vector<float>& texels, const Heightfield& map, Wrap wrap, const TextureRay& ray,
                        double t) {
  const auto [origin_x, origin_y] = place_at(map, ray, 0);
  const auto [x, y] = place_at(map, ray, t);
  const double blur_x = place_blur(origin_x, x);
  const double blur_y = place_blur(origin_y, y);
  if (std::max(blur_x, blur_y) >= 1) return 1;  // floats do not know the texel
  double steepest_x = 0;
  double steepest_y = 0;
  for (double cell_y = std::floor(y - blur_y); cell_y <= y + blur_y; ++cell_y) {
    for (double cell_x = std::floor(x - blur_x); cell_x <= x + blur_x; ++cell_x) {
      const auto [h] = cell_texels(texels, map, wrap, cell_x, cell_y);
      steepest_x = std::max({steepest_x, std::abs(h[0][1] - h[0][0]), std::abs(h[1][1] - h[1][0])});
      steepest_y = std::max({steepest_y, std::abs(h[1][0] - h[0][0]), std::abs(h[1][1] - h[0][1])});
    }
  }
  return std::min(1.0, steepest_x * blur_x + steepest_y * blur_y);
}

}  // namespace

double gap_above(const Heightfield& surface, Wrap wrap, const TextureRay& ray, double t) {
  const double over = gap_over(surface.texels, surface, wrap, ray, t);
  return surface.is_solid() ? std::max(over, -gap_over(surface.floors, surface, wrap, ray, t)) : over;
}

double arrival_gap(const Heightfield& surface, Wrap wrap, const TextureRay& ray, double t) {
  const double lift = lift_of_rounding(surface.texels, surface, wrap, ray, t);
  if (!surface.is_solid()) return kNearestGap + lift;
  return kNearestGap + std::max(lift, lift_of_rounding(surface.floors, surface, wrap, ray, t));
}

Kept keeps(Guarantee guarantee, const ScorePixel& pixel, const PixelScore& score, const ReferenceHit& reference,
           const Heightfield& surface, Wrap wrap) {
  if (guarantee == Guarantee::none) return Kept::yes;
  if (score.verdict == Verdict::missed || score.verdict == Verdict::false_kill)
    return reference.t_exit - reference.t_enter < kThinnestSolid ? Kept::unresolved : Kept::no;
  const bool is_early = score.verdict == Verdict::false_keep || score.verdict == Verdict::unconverged;
  const bool is_capped = pixel.status == static_cast<float>(PixelStatus::step_cap);
  if (guarantee != Guarantee::exact || !is_early || is_capped) return Kept::yes;
  const double allowed = arrival_gap(surface, wrap, pixel.ray, pixel.t);
  return gap_above(surface, wrap, pixel.ray, pixel.t) < allowed ? Kept::unresolved : Kept::no;
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

Kept keeps_bent(Guarantee guarantee, const ScorePixel& pixel, const Bend& bend, const Heightfield& surface, Wrap wrap) {
  if (guarantee == Guarantee::none) return Kept::yes;
  const auto t_end = static_cast<double>(pixel.t);
  const double travel_u = static_cast<double>(pixel.ray.slope_u) * surface.width;
  const double travel_v = static_cast<double>(pixel.ray.slope_v) * surface.height;
  const double blur = kBentBlur * (1 + std::hypot(travel_u, travel_v) * t_end + std::abs(bend.value) * t_end * t_end) +
                      bend.blur * t_end * t_end;
  const double x = static_cast<double>(pixel.ray.u) * surface.width - 0.5;
  const double y = static_cast<double>(pixel.ray.v) * surface.height - 0.5;
  const auto gap = [&](double t) { return gap_above(surface, wrap, pixel.ray, t) + bend.value * t * t; };
  double least = gap(0);
  // Within a cell the gap is a parabola: three of its points tell the lowest.
  for (double t = 0; t < t_end;) {
    const double next = std::min({next_border(x, travel_u, t), next_border(y, travel_v, t), t_end});
    const double a = gap(t);
    const double b = gap(0.5 * (t + next));
    const double c = gap(next);
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
  if (guarantee == Guarantee::exact && is_hit && std::abs(gap(t_end)) > blur) return Kept::no;
  return Kept::yes;
}

}  // namespace reliefbench
