#include "kernels/judge/heat_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

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
  if (value >= stops.back().value) return stops.back().color;
  const double octave = std::log2(value / stops.front().value);
  const auto low = std::min(static_cast<std::size_t>(octave), stops.size() - 2);
  const double weight = octave - static_cast<double>(low);
  Rgb color{};
  for (std::size_t c = 0; c < color.size(); ++c)
    color[c] = static_cast<std::uint8_t>(std::lround(std::lerp(stops[low].color[c], stops[low + 1].color[c], weight)));
  return color;
}

using Rgba = std::array<std::uint8_t, 4>;
constexpr Rgba opaque(const Rgb& color) { return {color[0], color[1], color[2], 255}; }

/// A ramp's colours, one for each of 2^kSliceBits slices of an octave: that of the slice's least value, one code beside
/// a value's own at most.
class Ramp {
 public:
  explicit Ramp(std::span<const HeatMapStop> stops) : least_(static_cast<float>(stops.front().value)) {
    const std::size_t count = slice(static_cast<float>(stops.back().value)) + 1;
    colors_.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto bits = static_cast<std::uint32_t>((slice_bits(least_) + i) << kShift);
      colors_.push_back(opaque(ramp_color(stops, std::bit_cast<float>(bits))));
    }
  }
  [[nodiscard]] Rgba operator[](float value) const {
    // Negated so that NaN is dark too: judge marks what is not finite as missed, it cannot come here as an error.
    if (!(value > least_)) return colors_.front();
    return colors_[std::min(slice(value), colors_.size() - 1)];
  }

 private:
  static constexpr int kSliceBits = 8;
  static constexpr int kShift = std::numeric_limits<float>::digits - 1 - kSliceBits;  // of a float's 23 bits
  static std::size_t slice_bits(float value) { return std::bit_cast<std::uint32_t>(value) >> kShift; }
  [[nodiscard]] std::size_t slice(float value) const { return slice_bits(value) - slice_bits(least_); }

  float least_;
  std::vector<Rgba> colors_;
};

constexpr std::array<std::optional<Rgba>, kVerdicts> kMarkColors = [] {
  std::array<std::optional<Rgba>, kVerdicts> colors{};
  for (const HeatMapMark& mark : kMarks) colors.at(static_cast<std::size_t>(mark.verdict)) = opaque(mark.color);
  return colors;
}();

Rgba error_color(const PixelScore& pixel) {
  static const Ramp ramp(kStops);
  const std::optional<Rgba>& mark = kMarkColors.at(static_cast<std::size_t>(pixel.verdict));
  return mark ? *mark : ramp[pixel.e_xy];
}

Rgba taps_color(const ScorePixel& pixel) {
  static const Ramp ramp(kTapStops);
  return pixel.status == static_cast<float>(PixelStatus::no_ray) ? opaque(kMarks.back().color) : ramp[pixel.taps];
}

/// RGBA8 of pixels, each in its own colour.
template <typename Pixel>
std::vector<std::uint8_t> colored(std::span<const Pixel> pixels, int width, int height,
                                  Rgba (*color_of)(const Pixel&)) {
  if (width < 0 || height < 0 || pixels.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    fail_input("heat map: {} pixels do not make a picture of {} x {}", pixels.size(), width, height);
  std::vector<std::uint8_t> rgba(pixels.size() * sizeof(Rgba));
  for_each_share(pixels.size(), [&](std::size_t, std::size_t first, std::size_t size) {
    for (std::size_t i = first; i < first + size; ++i) {
      const Rgba color = color_of(pixels[i]);
      std::memcpy(&rgba[i * sizeof(Rgba)], color.data(), sizeof(Rgba));
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
