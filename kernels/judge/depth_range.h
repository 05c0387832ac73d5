#pragma once

namespace reliefbench {

// What depth buffers hold: far / (far - near) * (1 - near / depth), of a depth along the view's axis.
inline constexpr double kNearPlane = 1.0 / 16;      ///< of the distance from the camera to the point that it looks at
inline constexpr double kDepthRange = 1024;         ///< far plane over near plane
inline constexpr float kFarthest = 0x1.fffffep-1F;  ///< what is farther counts as so far: nearer than an empty frame

/// What a pixel of a frame with depth shows, as its alpha in 255ths.
enum class SeenObject { occluder = 252, ball = 253, square = 254, relief = 255 };

}  // namespace reliefbench
