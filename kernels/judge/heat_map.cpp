#include "kernels/judge/heat_map.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"

namespace reliefbench {
namespace {

constexpr std::array<HeatMapStop, 11> kStops = {{{1.0 / 64, {0, 0, 4}},
                                                 {1.0 / 32, {22, 11, 57}},
                                                 {1.0 / 16, {66, 10, 104}},
                                                 {1.0 / 8, {106, 23, 110}},
                                                 {1.0 / 4, {147, 38, 103}},
                                                 {1.0 / 2, {188, 55, 84}},
                                                 {1.0, {221, 81, 58}},
                                                 {2.0, {243, 120, 25}},
                                                 {4.0, {252, 165, 10}},
                                                 {8.0, {246, 215, 70}},
                                                 {16.0, {252, 255, 164}}}};

constexpr std::array<HeatMapMark, 3> kMarks = {{{Verdict::missed, "missed: stepped over the first hit", {255, 0, 255}},
                                                {Verdict::unconverged, "unconverged: stopped early", {0, 229, 255}},
                                                {Verdict::no_ray, "no ray", {128, 128, 128}}}};

Rgb ramp_color(double e_xy) {
  // Negated so that NaN is dark too: judge marks what is not finite as missed, it cannot come here as an error.
  if (!(e_xy > kStops.front().e_xy)) return kStops.front().color;
  if (e_xy >= kStops.back().e_xy) return kStops.back().color;
  const double octave = std::log2(e_xy / kStops.front().e_xy);
  const auto low = std::min(static_cast<std::size_t>(octave), kStops.size() - 2);
  const double weight = octave - static_cast<double>(low);
  Rgb color{};
  for (std::size_t c = 0; c < color.size(); ++c)
    color[c] =
        static_cast<std::uint8_t>(std::lround(std::lerp(kStops[low].color[c], kStops[low + 1].color[c], weight)));
  return color;
}

Rgb pixel_color(const PixelScore& pixel) {
  for (const HeatMapMark& mark : kMarks)
    if (mark.verdict == pixel.verdict) return mark.color;
  return ramp_color(pixel.e_xy);
}

}  // namespace

HeatMapLegend heat_map_legend() { return {.stops = kStops, .marks = kMarks}; }

std::vector<std::uint8_t> heat_map(std::span<const PixelScore> pixels, int width, int height) {
  if (width < 0 || height < 0 || pixels.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    fail_input("heat map: {} pixels do not make a picture of {} x {}", pixels.size(), width, height);
  std::vector<std::uint8_t> rgba(pixels.size() * 4);
  for_each_share(pixels.size(), [&](std::size_t, std::size_t first, std::size_t size) {
    for (std::size_t i = first; i < first + size; ++i) {
      const Rgb color = pixel_color(pixels[i]);
      std::ranges::copy(color, rgba.begin() + static_cast<std::ptrdiff_t>(4 * i));
      rgba[4 * i + 3] = 255;
    }
  });
  return rgba;
}

}  // namespace reliefbench
