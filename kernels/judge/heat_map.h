#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/judge/score_pixel.h"

namespace reliefbench {

using Rgb = std::array<std::uint8_t, 3>;

/// A colour of the ramp. Between two stops colours mix linearly in sRGB along log2(value), as a CSS gradient does.
struct HeatMapStop {
  double value;  ///< e_xy in texels, or taps
  Rgb color;
};

/// A colour outside the ramp: pixels whose error is of another kind, whatever its size.
struct HeatMapMark {
  Verdict verdict;
  std::string_view description;
  Rgb color;
};

struct HeatMapLegend {
  std::span<const HeatMapStop> stops;  ///< one an octave, dark to light
  std::span<const HeatMapMark> marks;  ///< missed, unconverged, false_keep, false_kill, no_ray
};

/// What the colours of every heat map of errors mean, 1/64 to 16 texels: the scale is fixed, so any two pictures
/// compare. source: control points of matplotlib's "inferno" (CC0), even in lightness, readable by the colour-blind
[[nodiscard]] HeatMapLegend heat_map_legend();

/// Picture of e_xy, RGBA8, in the row order of `pixels`. `inside` has no mark: it is an error of a known size.
/// pixels: width x height, row-major; throws: Error(bad_input) where the sizes disagree
[[nodiscard]] std::vector<std::uint8_t> heat_map(std::span<const PixelScore> pixels, int width, int height);

/// What the colours of every map of taps mean, 1 to 1024 texture instructions; its one mark is no_ray.
/// source: control points of matplotlib's "viridis" (CC0)
[[nodiscard]] HeatMapLegend taps_map_legend();

/// Picture of the texture instructions that each pixel's trace took, RGBA8. As heat_map.
[[nodiscard]] std::vector<std::uint8_t> taps_map(std::span<const ScorePixel> pixels, int width, int height);

}  // namespace reliefbench
