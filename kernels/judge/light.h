#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/judge/score_pixel.h"

namespace reliefbench {

/// A disc that is infinitely far away, over a plane whose relief has a depth.
struct LightSource {
  std::array<double, 3> direction{};  ///< unit, towards its middle; z away from the plane
  double radius = 0;                  ///< tangent of its angular radius; 0: a point
  double relief_depth = 0;            ///< in sides of a tile
};

inline constexpr int kLightStrata = 8;  ///< a side: a disc is looked at in the middles of 8 x 8 parts of equal area

/// Towards the light, of any length: one to a point, kLightStrata^2 to a disc.
[[nodiscard]] std::vector<std::array<double, 3>> light_directions(const LightSource& light);

/// The rays from a point of a plane to the light. Without those that do not rise: no light comes from there.
[[nodiscard]] std::vector<RisingRay> light_rays(const LightSource& light, double u, double v);

/// The share of the light that arrives at the exact hit of each ray, 0 to 1: of a point exactly (0 or 1), of a disc the
/// share of its directions. The surface under the hit is where they begin, so that no bias is needed.
/// hits: of these rays; threads: 0: as many as the machine has
[[nodiscard]] std::vector<float> exact_light(const ReferenceTracer& tracer, const LightSource& light,
                                             std::span<const TextureRay> rays, std::span<const ReferenceHit> hits,
                                             int threads = 0);

/// A position of t texels in floats may be off by some t times this; on a cliff a height is off by as much.
inline constexpr double kFloatLift = 0x1p-21;

/// How many pixels are lit, if only in part, though the way to the middle of the light is barred to a ray that begins
/// higher than where they were found, or than the surface there, by what floats may lose.
/// map_width, map_height: texels; shares: of the light, as they were found
[[nodiscard]] std::int64_t falsely_lit(const ReferenceTracer& tracer, const LightSource& light, int map_width,
                                       int map_height, std::span<const ScorePixel> pixels,
                                       std::span<const float> shares);

inline constexpr int kLightVersion = 1;  ///< of exact_light(): raised when a result changes

}  // namespace reliefbench
