#include "kernels/trace/guarantee.h"

#include <algorithm>
#include <cmath>

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
  if (score.verdict == Verdict::false_hole)
    return reference.t_exit - reference.t_enter < kThinnestSolid ? Kept::unresolved : Kept::no;
  if (score.verdict == Verdict::false_solid && guarantee == Guarantee::exact && !is_capped)
    return gap_above(surface, wrap, pixel.ray, pixel.t) < kNearestGap ? Kept::unresolved : Kept::no;
  if (guarantee != Guarantee::exact || score.verdict != Verdict::unconverged || is_capped) return Kept::yes;
  return gap_above(surface, wrap, pixel.ray, pixel.t) < kNearestGap ? Kept::unresolved : Kept::no;
}

}  // namespace reliefbench
