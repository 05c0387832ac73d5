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

constexpr std::array<HeatMapStop, 11> kTapStops = {{{1, {68, 1, 84}},
                                                    {2, {72, 36, 117}},
                                                    {4, {65, 68, 135}},
                                                    {8, {53, 95, 141}},
                                                    {16, {42, 120, 142}},
                                                    {32, {33, 145, 140}},
                                                    {64, {34, 168, 132}},
                                                    {128, {68, 191, 112}},
                                                    {256, {122, 209, 81}},
                                                    {512, {189, 223, 38}},
                                                    {1024, {253, 231, 37}}}};

constexpr std::array<HeatMapMark, 6> kMarks = {{{Verdict::missed, "missed: stepped over the first hit", {255, 0, 255}},
                                                {Verdict::unconverged, "unconverged: stopped early", {0, 229, 255}},
                                                {Verdict::false_keep, "kept: its ray should pass", {0, 96, 255}},
                                                {Verdict::false_kill, "killed: its ray should hit", {64, 255, 64}},
                                                {Verdict::passed, "passed", {160, 160, 160}},
                                                {Verdict::no_ray, "no ray", {128, 128, 128}}}};

Rgb ramp_color(std::span<const HeatMapStop> stops, double value) {
  // Negated so that NaN is dark too: judge marks what is not finite as missed, it cannot come here as an error.
  if (!(value > stops.front().value)) return stops.front().color;
  if (value >= stops.back().value) return stops.back().color;
  const double octave = std::log2(value / stops.front().value);
  const auto low = std::min(static_cast<std::size_t>(octave), stops.size() - 2);
  const double weight = octave - static_cast<double>(low);
  Rgb color{};
  for (std::size_t c = 0; c < color.size(); ++c)
    color[c] = static_cast<std::uint8_t>(std::lround(std::lerp(stops[low].color[c], stops[low + 1].color[c], weight)));
  return color;
}

Rgb error_color(const PixelScore& pixel) {
  for (const HeatMapMark& mark : kMarks)
    if (mark.verdict == pixel.verdict) return mark.color;
  return ramp_color(kStops, pixel.e_xy);
}

Rgb taps_color(const ScorePixel& pixel) {
  if (pixel.status == static_cast<float>(PixelStatus::no_ray)) return kMarks.back().color;
  return ramp_color(kTapStops, pixel.taps);
}

/// RGBA8 of pixels, each in its own colour.
template <typename Pixel>
std::vector<std::uint8_t> colored(std::span<const Pixel> pixels, int width, int height, Rgb (*color_of)(const Pixel&)) {
  if (width < 0 || height < 0 || pixels.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    fail_input("heat map: {} pixels do not make a picture of {} x {}", pixels.size(), width, height);
  std::vector<std::uint8_t> rgba(pixels.size() * 4);
  for_each_share(pixels.size(), [&](std::size_t, std::size_t first, std::size_t size) {
    for (std::size_t i = first; i < first + size; ++i) {
      const Rgb color = color_of(pixels[i]);
      std::ranges::copy(color, rgba.begin() + static_cast<std::ptrdiff_t>(4 * i));
      rgba[4 * i + 3] = 255;
    }
  });
  return rgba;
}

}  // namespace

HeatMapLegend heat_map_legend() { return {.stops = kStops, .marks = kMarks}; }
HeatMapLegend taps_map_legend() { return {.stops = kTapStops, .marks = std::span(kMarks).last(1)}; }

std::vector<std::uint8_t> heat_map(std::span<const PixelScore> pixels, int width, int height) {
  return colored(pixels, width, height, error_color);
}

std::vector<std::uint8_t> taps_map(std::span<const ScorePixel> pixels, int width, int height) {
  return colored(pixels, width, height, taps_color);
}

}  // namespace reliefbench
