#pragma once
#include <span>
#include <vector>

#include "kernels/judge/light.h"
#include "kernels/judge/score.h"
#include "kernels/trace/surface.h"

namespace reliefbench {

struct Mesh;

// Exact hits of frames on any surface. On a plane they are those of the rays that pixels say they traced. On a curved
// one they are those of the pixels' straight rays in the world with the displaced surface itself, from where they enter
// at the top plate to where they leave it again; what stands behind that is another fragment's.

inline constexpr int kSurfaceVersion = 2;  ///< of exact hits on curved surfaces: raised when one changes

/// The exact solid interval along a pixel's ray. t counts as if the plane that touches where the ray enters were the
/// surface: 0 there, 1 on that plane's bottom plate; a curved surface's bottom may lie beyond. A ray that leaves
/// through the top plate passes. Cells are told apart by bounds of first and second order; a stretch that they do not
/// decide at kTouchWay counts as a touch. A hit lies within that of the exact one.
[[nodiscard]] ReferenceHit trace_surface(const ReferenceTracer& tracer, const SurfaceShape& shape,
                                         const SurfaceRay& ray, Wrap wrap);
inline constexpr double kTouchWay = 1e-11;  ///< in sides of the unit square

/// Of a score frame; of a pixel without a ray {}. mesh: that the frame is on, if it is on one
[[nodiscard]] std::vector<ReferenceHit> exact_hits(const ReferenceTracer& tracer, const FrameUniforms& frame, Wrap wrap,
                                                   std::span<const ScorePixel> pixels, const Mesh* mesh = nullptr);

/// The share of the light, whose direction is in the world, that arrives at each pixel's exact hit on a curved surface
/// that is no mesh: of its straight ways to where they leave the top plate, those that meet nothing of the displaced
/// surface. They begin kLightLift over the hit, along the normal. 0 where a ray passes.
[[nodiscard]] std::vector<float> exact_light(const ReferenceTracer& tracer, const LightSource& light,
                                             const FrameUniforms& frame, std::span<const ReferenceHit> hits);
inline constexpr double kLightLift = 1e-7;  ///< in heights: what a hit may err by is a thousandth of it

/// What pixels' hits are worth against exact_hits() of the same frame. On a curved surface e_xy is the way between both
/// hits' places on the map, in texels, and pixels that should not be covered, or are not but should, have a verdict of
/// their own and no distance. On a mesh, whose map may go on anywhere, it is the way along the pixel's ray, as on a
/// plane.
[[nodiscard]] PixelScores judge_pixels(const FrameUniforms& frame, Wrap wrap, std::span<const ScorePixel> pixels,
                                       std::span<const ReferenceHit> exact);
/// is_solid: the heights have floors
[[nodiscard]] JudgedFrame judge(const FrameUniforms& frame, Wrap wrap, bool is_solid,
                                std::span<const ScorePixel> pixels, std::span<const ReferenceHit> exact);

}  // namespace reliefbench
