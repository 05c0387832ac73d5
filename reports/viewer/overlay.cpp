#include "reports/viewer/overlay.h"

#include <fmt/format.h>

#include <algorithm>

namespace reliefbench {
namespace {

/// A power of two as people write it: "1/64", "16".
std::string octave_text(double value) {
  return value < 1 ? fmt::format("1/{:.0f}", 1 / value) : fmt::format("{:.0f}", value);
}

std::vector<std::uint8_t> taps_picture(const OverlayPixels& pixels) {
  std::vector<ScorePixel> found(pixels.taps.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    found[i] = {.ray = {},
                .status = static_cast<float>(pixels.taps[i] < 0 ? PixelStatus::no_ray : PixelStatus::hit),
                .taps = pixels.taps[i]};
  return taps_map(found, pixels.width_px, pixels.height_px);
}

bool is_mark_over_frame(Verdict verdict) {
  return verdict == Verdict::missed || verdict == Verdict::unconverged || is_false_coverage(verdict);
}

/// Marks of what failed; nothing elsewhere.
std::vector<std::uint8_t> marks_picture(const OverlayPixels& pixels) {
  std::vector<std::uint8_t> rgba8 = heat_map(pixels.scores, pixels.width_px, pixels.height_px);
  for (std::size_t i = 0; i < pixels.scores.size(); ++i)
    rgba8[4 * i + 3] = is_mark_over_frame(pixels.scores[i].verdict) ? 255 : 0;
  return rgba8;
}

}  // namespace

std::vector<std::uint8_t> overlay_picture(Overlay overlay, const OverlayPixels& pixels) {
  if (overlay == Overlay::taps) return taps_picture(pixels);
  if (overlay == Overlay::missed) return marks_picture(pixels);
  return heat_map(pixels.scores, pixels.width_px, pixels.height_px);
}

OverlayLegend overlay_legend(Overlay overlay) {
  OverlayLegend legend;
  if (overlay == Overlay::none) return legend;
  const bool is_taps = overlay == Overlay::taps;
  const HeatMapLegend colors = is_taps ? taps_map_legend() : heat_map_legend();
  legend.title = is_taps ? "texture taps a pixel" : "error of the hit, texels";
  if (overlay == Overlay::missed)
    legend.title = "hits that failed";
  else
    for (const HeatMapStop& stop : colors.stops)
      legend.ramp.push_back({.color = stop.color, .text = octave_text(stop.value)});
  for (const HeatMapMark& mark : colors.marks) {
    if (overlay != Overlay::missed || is_mark_over_frame(mark.verdict))
      legend.marks.push_back({.color = mark.color, .text = std::string(mark.description)});
  }
  return legend;
}

}  // namespace reliefbench
