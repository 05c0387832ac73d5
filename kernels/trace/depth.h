#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/judge/depth_range.h"
#include "kernels/judge/reference.h"
#include "kernels/judge/score_pixel.h"
#include "kernels/trace/view.h"

namespace reliefbench {

// Depths of frames that hold other objects, in double precision. The shaders' twins: depth.glsl, eye.glsl,
// objects.frag.

inline constexpr int kDepthVersion = 1;  ///< of the exact values
inline constexpr double kSquareSide = 0.5;
inline constexpr double kBallRadius = 0.2;

/// Of a pixel's ray, its floats taken exactly, along the view's axis in sides of the unit square.
struct PixelDepths {
  double fall = 0;    ///< height that the ray loses for each unit of that depth; <= 0: it never comes down
  double height = 0;  ///< of the eye over the top plate; of a curved one over the plane that touches where it enters
  double relief = 0;  ///< from plate to plate

  // On a curved surface, where roots are the driver's: what floats may have wrong, at most.
  double way_blur = 0;  ///< of the depth where the ray enters
  double fall_blur = 0;

  /// Of the point at t of the ray.
  [[nodiscard]] double at(double t) const { return (height + t * relief) / fall; }
  [[nodiscard]] double blur_at(double t) const { return way_blur + t * relief * (1 / (fall - fall_blur) - 1 / fall); }
};
/// Not of a mesh. wrap: with clamp, rays beside the unit square of a curved surface do not come down
[[nodiscard]] PixelDepths pixel_depths(const FrameUniforms& frame, Wrap wrap, int x, int y);

/// What a depth buffer holds of a depth along the axis, clamped to what may be written: 0 to kFarthest.
[[nodiscard]] double window_depth(const FrameUniforms& frame, double depth);

/// Exact depths of exact hits, one a pixel; kFarthest where there is no ray.
[[nodiscard]] std::vector<float> exact_depth(const FrameUniforms& frame, Wrap wrap, std::span<const ReferenceHit> hits);

/// How many pixels have another depth than their own hit's: by more than 4 ulps of 1 and what the rounding of the
/// pixel's ray makes, or nearer than the top plate by more than that.
[[nodiscard]] std::int64_t wrong_depths(const FrameUniforms& frame, Wrap wrap, std::span<const ScorePixel> pixels,
                                        std::span<const float> depths);

/// What pixels show of the relief and the objects that cut through it, with these depths of the relief, t of whose rays
/// are given; not the occluder. hits: exact ones
[[nodiscard]] std::vector<SeenObject> exact_visibility(const FrameUniforms& frame, Wrap wrap,
                                                       std::span<const ReferenceHit> hits);

}  // namespace reliefbench
