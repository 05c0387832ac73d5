#include "kernels/judge/score.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>

namespace reliefbench {
namespace {

constexpr double kRecoverableTexels = 0.5;  // nearer than this a hit is good, whatever came before

bool has_ray(const ScorePixel& pixel) {
  return pixel.status != static_cast<float>(PixelStatus::no_ray) && std::isfinite(pixel.ray.u) &&
         std::isfinite(pixel.ray.v) && std::isfinite(pixel.ray.slope_u) && std::isfinite(pixel.ray.slope_v);
}

float to_float(double error) {
  return static_cast<float>(std::min(error, static_cast<double>(std::numeric_limits<float>::max())));
}

Verdict judge(const ScorePixel& pixel, const ReferenceHit& reference, double e_xy) {
  const double t = pixel.t;
  // The found t is a float: the two around t_enter are as good as it can be, even where the ray only touches.
  const auto nearest = static_cast<float>(reference.t_enter);
  const bool is_beyond = pixel.t > std::nextafter(nearest, 2.0F);
  if (is_beyond && t >= reference.t_exit) return Verdict::missed;
  if (e_xy <= kRecoverableTexels) return Verdict::good;
  if (t < reference.t_enter || pixel.status == static_cast<float>(PixelStatus::step_cap)) return Verdict::unconverged;
  return Verdict::inside;
}

PixelScore score_pixel(const ScorePixel& pixel, const ReferenceHit& reference, int map_width, int map_height) {
  if (!has_ray(pixel)) return {};
  const double travel_texels = std::hypot(static_cast<double>(pixel.ray.slope_u) * map_width,
                                          static_cast<double>(pixel.ray.slope_v) * map_height);
  if (!std::isfinite(pixel.t)) return {.e_xy = to_float(travel_texels), .e_z = 1, .verdict = Verdict::missed};
  const double e_z = std::abs(static_cast<double>(pixel.t) - reference.t_enter);
  const double e_xy = e_z * travel_texels;
  return {.e_xy = to_float(e_xy), .e_z = to_float(e_z), .verdict = judge(pixel, reference, e_xy)};
}

/// Percentiles by nearest rank: the smallest value that at least p of all values do not exceed.
Distribution distribution(std::vector<float> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto count = static_cast<double>(values.size());
  const auto percentile = [&](double percent) {
    const auto rank = static_cast<std::size_t>(std::ceil(percent * count / 100));
    return static_cast<double>(values[rank - 1]);
  };
  double sum = 0;
  for (const float value : values) sum += static_cast<double>(value);
  return {.mean = sum / count,
          .p50 = percentile(50),
          .p95 = percentile(95),
          .p99 = percentile(99),
          .max = static_cast<double>(values.back())};
}

}  // namespace

std::vector<TextureRay> rays_of(std::span<const ScorePixel> pixels) {
  std::vector<TextureRay> rays;
  rays.reserve(pixels.size());
  for (const ScorePixel& pixel : pixels) rays.push_back(pixel.ray);
  return rays;
}

JudgedFrame judge_frame(std::span<const ScorePixel> pixels, std::span<const ReferenceHit> reference, int map_width,
                        int map_height) {
  assert(pixels.size() == reference.size());
  JudgedFrame frame;
  frame.pixels.reserve(pixels.size());
  std::vector<float> e_xy;
  std::vector<float> e_z;
  std::int64_t missed = 0;
  std::int64_t inside = 0;
  std::int64_t unconverged = 0;
  double taps = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const PixelScore& score = frame.pixels.emplace_back(score_pixel(pixels[i], reference[i], map_width, map_height));
    if (score.verdict == Verdict::no_ray) continue;
    e_xy.push_back(score.e_xy);
    e_z.push_back(score.e_z);
    missed += score.verdict == Verdict::missed ? 1 : 0;
    inside += score.verdict == Verdict::inside ? 1 : 0;
    unconverged += score.verdict == Verdict::unconverged ? 1 : 0;
    taps += static_cast<double>(pixels[i].taps);
    frame.score.max_taps = std::max(frame.score.max_taps, static_cast<double>(pixels[i].taps));
  }
  if (e_xy.empty()) return frame;
  FrameScore& score = frame.score;
  score.pixels = static_cast<std::int64_t>(e_xy.size());
  const auto count = static_cast<double>(e_xy.size());
  score.e_xy = distribution(std::move(e_xy));
  score.e_z = distribution(std::move(e_z));
  score.missed_rate = static_cast<double>(missed) / count;
  score.inside_rate = static_cast<double>(inside) / count;
  score.unconverged_rate = static_cast<double>(unconverged) / count;
  score.mean_taps = taps / count;
  return frame;
}

std::optional<double> psnr_rgba8(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b,
                                 std::span<const PixelScore> mask) {
  assert(a.size() == 4 * mask.size() && b.size() == 4 * mask.size());
  std::int64_t squares = 0;
  std::int64_t values = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i].verdict == Verdict::no_ray) continue;
    for (std::size_t channel = 4 * i; channel < 4 * i + 3; ++channel) {
      const std::int64_t difference = static_cast<int>(a[channel]) - static_cast<int>(b[channel]);
      squares += difference * difference;
      ++values;
    }
  }
  if (squares == 0) return std::nullopt;
  const double mean_square = static_cast<double>(squares) / static_cast<double>(values);
  return 10 * std::log10(255.0 * 255.0 / mean_square);
}

}  // namespace reliefbench
