#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/judge/score_pixel.h"

namespace reliefbench {

using Rgb = std::array<std::uint8_t, 3>;

/// A colour of the ramp. Between two stops colours mix linearly in sRGB along log2(e_xy), as a CSS gradient does.
struct HeatMapStop {
  double e_xy;  ///< texels
  Rgb color;
};

/// A colour outside the ramp: pixels whose error is of another kind, whatever its size.
struct HeatMapMark {
  Verdict verdict;
  std::string_view description;
  Rgb color;
};

struct HeatMapLegend {
  std::span<const HeatMapStop> stops;  ///< one an octave, 1/64 to 16 texels, dark to light
  std::span<const HeatMapMark> marks;  ///< missed, unconverged, no_ray
};

/// What the colours of every heat map mean: the scale is fixed, so any two pictures compare.
/// source: control points of matplotlib's "inferno" (CC0), even in lightness, readable by the colour-blind
[[nodiscard]] HeatMapLegend heat_map_legend();

/// Picture of e_xy, RGBA8, in the row order of `pixels`. `inside` has no mark: it is an error of a known size.
/// pixels: width x height, row-major; throws: Error(bad_input) where the sizes disagree
[[nodiscard]] std::vector<std::uint8_t> heat_map(std::span<const PixelScore> pixels, int width, int height);

}  // namespace reliefbench
