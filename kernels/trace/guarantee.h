#pragma once
#include "kernels/image/heightfield.h"
#include "kernels/judge/score_pixel.h"
#include "kernels/trace/technique.h"

namespace reliefbench {

/// How finely a trace in floats can be held to the exact surface.
inline constexpr double kThinnestSolid = 0x1p-23;  ///< of t: holds less than two floats, so rounding alone may pass it
inline constexpr double kNearestGap = 0x1p-22;     ///< of height: nearer than this any ray may count as having arrived

/// Height of the ray above the surface at t, in double precision; negative inside the relief. Of a solid the height
/// over its upper surface or under its lower one, whichever is more.
[[nodiscard]] double gap_above(const Heightfield& surface, Wrap wrap, const TextureRay& ray, double t);

/// A ray that stops less than this above the surface may have arrived: kNearestGap, and what the rounding of its place
/// in float makes of the slopes there. Far rays know their place badly: hundreds of texels on, to 2^-20 of the way.
[[nodiscard]] double arrival_gap(const Heightfield& surface, Wrap wrap, const TextureRay& ray, double t);

enum class Kept {
  yes,
  unresolved,  ///< only by a solid thinner than kThinnestSolid that was passed, or a stop less than arrival_gap above
  no,
};
/// Whether a pixel keeps a guarantee. exact lets a ray stop early only at its step cap.
/// score, reference: of this pixel; surface: the heights as stored
[[nodiscard]] Kept keeps(Guarantee guarantee, const ScorePixel& pixel, const PixelScore& score,
                         const ReferenceHit& reference, const Heightfield& surface, Wrap wrap);

/// How a ray is bent: height 1 - t + bend t^2.
struct Bend {
  double value = 0;
  double blur = 0;  ///< what floats may have wrong of it (SurfaceRay::bend_blur)
};
/// Likewise of a ray that is bent. Every cell on its way is looked at. What floats lose of the bend and of the ray's
/// place is no fault.
[[nodiscard]] Kept keeps_bent(Guarantee guarantee, const ScorePixel& pixel, const Bend& bend,
                              const Heightfield& surface, Wrap wrap);

}  // namespace reliefbench
