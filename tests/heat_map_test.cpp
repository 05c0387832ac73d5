#include "kernels/judge/heat_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

Rgb color_of(PixelScore pixel) {
  const std::vector<std::uint8_t> rgba = heat_map(std::span(&pixel, 1), 1, 1);
  EXPECT_EQ(rgba.size(), 4u);
  EXPECT_EQ(rgba[3], 255);
  return {rgba[0], rgba[1], rgba[2]};
}

Rgb color_of_error(double e_xy) {
  return color_of({.e_xy = static_cast<float>(e_xy), .e_z = 0, .verdict = Verdict::good});
}

double luminance(Rgb c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

TEST(HeatMap, PicturesShowWhatTheLegendSays) {
  for (const HeatMapStop& stop : heat_map_legend().stops) EXPECT_EQ(color_of_error(stop.value), stop.color);
  for (const HeatMapMark& mark : heat_map_legend().marks)
    EXPECT_EQ(color_of({.e_xy = 3, .e_z = 0, .verdict = mark.verdict}), mark.color);
}

TEST(HeatMap, StopsAreOneAnOctaveAsTheGradientOfTheLegendAssumes) {
  const std::span<const HeatMapStop> stops = heat_map_legend().stops;
  EXPECT_EQ(stops.front().value, 1.0 / 64);
  EXPECT_EQ(stops.back().value, 16);
  for (std::size_t i = 1; i < stops.size(); ++i) EXPECT_EQ(stops[i].value, 2 * stops[i - 1].value);
}

TEST(HeatMap, ColoursMixAlongTheLogarithmWithinACode) {
  const std::span<const HeatMapStop> stops = heat_map_legend().stops;
  for (int step = -6000; step < 4000; ++step) {
    const double octave = step / 1000.0;
    const auto low = static_cast<std::size_t>(std::floor(octave) + 6);
    const Rgb found = color_of_error(std::exp2(octave));
    for (std::size_t c = 0; c < found.size(); ++c)
      EXPECT_NEAR(found[c], std::lerp(stops[low].color[c], stops[low + 1].color[c], octave - std::floor(octave)), 1)
          << std::exp2(octave) << " texels";
  }
}

TEST(HeatMap, GrowsLighterWithTheError) {
  double last = -1;
  for (int quarter = -24; quarter <= 16; ++quarter) {
    const double e_xy = std::exp2(quarter / 4.0);
    const double now = luminance(color_of_error(e_xy));
    EXPECT_GT(now, last) << "at " << e_xy << " texels";
    last = now;
  }
}

TEST(HeatMap, ErrorsOutsideTheScaleTakeItsEnds) {
  EXPECT_EQ(color_of_error(0), heat_map_legend().stops.front().color);
  EXPECT_EQ(color_of_error(NAN), heat_map_legend().stops.front().color);
  EXPECT_EQ(color_of_error(1e30), heat_map_legend().stops.back().color);
  EXPECT_EQ(color_of_error(INFINITY), heat_map_legend().stops.back().color);
}

TEST(HeatMap, MarksAreNotColoursOfTheRamp) {
  for (const HeatMapMark& mark : heat_map_legend().marks)
    for (int step = -120; step <= 80; ++step) {
      const double e_xy = std::exp2(step / 20.0);
      const Rgb ramp = color_of_error(e_xy);
      const double distance = std::hypot(mark.color[0] - ramp[0], mark.color[1] - ramp[1], mark.color[2] - ramp[2]);
      EXPECT_GT(distance, 60) << mark.description << " at " << e_xy << " texels";
    }
}

TEST(HeatMap, KeepsTheRowOrderAndRefusesAnotherSize) {
  std::vector<PixelScore> pixels(6, PixelScore{.e_xy = 0, .e_z = 0, .verdict = Verdict::good});
  pixels[4].verdict = Verdict::missed;
  const std::vector<std::uint8_t> rgba = heat_map(pixels, 3, 2);
  ASSERT_EQ(rgba.size(), 24u);
  EXPECT_EQ(rgba[16], 255);
  EXPECT_EQ(rgba[12], 0);
  EXPECT_TRUE(heat_map({}, 0, 0).empty());
  EXPECT_THROW((void)heat_map(pixels, 2, 2), Error);
  EXPECT_THROW((void)heat_map(pixels, -3, -2), Error);
}

TEST(TapsMap, PicturesShowWhatTheLegendSays) {
  const auto color_of_taps = [](float taps, PixelStatus status) {
    const ScorePixel pixel{.ray = {}, .t = 0, .status = static_cast<float>(status), .taps = taps, .steps = 0};
    const std::vector<std::uint8_t> rgba = taps_map(std::span(&pixel, 1), 1, 1);
    return Rgb{rgba[0], rgba[1], rgba[2]};
  };
  for (const HeatMapStop& stop : taps_map_legend().stops)
    EXPECT_EQ(color_of_taps(static_cast<float>(stop.value), PixelStatus::step_cap), stop.color);
  EXPECT_EQ(color_of_taps(5, PixelStatus::no_ray), taps_map_legend().marks.front().color);
  EXPECT_EQ(taps_map_legend().marks.front().verdict, Verdict::no_ray);
}

}  // namespace
}  // namespace reliefbench
