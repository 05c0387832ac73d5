#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kernels/judge/heat_map.h"
#include "reports/viewer/view_choice.h"

namespace reliefbench {

/// What an overlay's pixels show.
struct OverlayPixels {
  std::span<const PixelScore> scores;  ///< frame size, row-major
  std::span<const float> taps;         ///< likewise; negative without a ray
  int width_px;
  int height_px;
};
/// RGBA8; where alpha is 0 the shaded frame is seen. overlay: not none
[[nodiscard]] std::vector<std::uint8_t> overlay_picture(Overlay overlay, const OverlayPixels& pixels);

/// One colour of a legend with what it means.
struct LegendEntry {
  Rgb color;
  std::string text;
};
struct OverlayLegend {
  std::string title{};
  std::vector<LegendEntry> ramp{};   ///< from dark to light
  std::vector<LegendEntry> marks{};  ///< beside the ramp
};
[[nodiscard]] OverlayLegend overlay_legend(Overlay overlay);

}  // namespace reliefbench
