#include "kernels/judge/score.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

#include "kernels/base/parallel.h"

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

Verdict verdict_of(const ScorePixel& pixel, const ReferenceHit& reference, double e_xy) {
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
  return {.e_xy = to_float(e_xy), .e_z = to_float(e_z), .verdict = verdict_of(pixel, reference, e_xy)};
}

/// Fills in a metric's numbers. values: of the pixels with a ray; their order changes where a percentile is asked for
void fill_in(const Metric& metric, std::vector<float>& values, std::span<std::optional<double>> numbers) {
  const auto count = static_cast<double>(values.size());
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  auto from = values.begin();  // all before it are no greater than all after it: percentiles are asked for in order
  // By nearest rank: the smallest value that at least `percent` of all do not exceed.
  const auto percentile = [&](double percent) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(std::ceil(percent * count / 100)) - 1;
    std::nth_element(from, place, values.end());
    from = place;
    return static_cast<double>(*place);
  };
  for (std::size_t i = 0; i < metric.aggregates.size(); ++i) {
    switch (metric.aggregates[i]) {
      case Aggregate::mean:
        numbers[i] = sum / count;
        break;
      case Aggregate::p50:
        numbers[i] = percentile(50);
        break;
      case Aggregate::p95:
        numbers[i] = percentile(95);
        break;
      case Aggregate::p99:
        numbers[i] = percentile(99);
        break;
      case Aggregate::max:
        numbers[i] = static_cast<double>(*std::max_element(from, values.end()));
        break;
    }
  }
}

/// Calls use(function, numbers) for the metrics whose function is of one kind.
template <typename Function, typename Use>
void each_metric(FrameScore& score, const Use& use) {
  std::size_t place = 0;
  for (const Metric& metric : kMetrics) {
    const std::span numbers = std::span(score.values).subspan(place, metric.aggregates.size());
    place += metric.aggregates.size();
    if (const auto* function = std::get_if<Function>(&metric.function)) use(metric, *function, numbers);
  }
}

}  // namespace

std::vector<TextureRay> rays_of(std::span<const ScorePixel> pixels) {
  std::vector<TextureRay> rays;
  rays.reserve(pixels.size());
  for (const ScorePixel& pixel : pixels) rays.push_back(pixel.ray);
  return rays;
}

std::vector<ReferenceHit> exact_hits(const ReferenceTracer& tracer, std::span<const ScorePixel> pixels) {
  std::vector<TextureRay> rays;
  std::vector<std::size_t> where;
  rays.reserve(pixels.size());
  where.reserve(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i].status == static_cast<float>(PixelStatus::no_ray)) continue;
    rays.push_back(pixels[i].ray);
    where.push_back(i);
  }
  const std::vector<ReferenceHit> traced = tracer.trace(rays);
  std::vector<ReferenceHit> hits(pixels.size());
  for (std::size_t i = 0; i < traced.size(); ++i) hits[where[i]] = traced[i];
  return hits;
}

JudgedFrame judge(std::span<const ScorePixel> pixels, std::span<const ReferenceHit> reference, int map_width,
                  int map_height) {
  assert(pixels.size() == reference.size());
  JudgedFrame frame;
  frame.pixels.resize(pixels.size());
  constexpr std::size_t kShare = 1U << 16U;  // pixels a task
  parallel_for(static_cast<int>((pixels.size() + kShare - 1) / kShare), 0, [&](int task) {
    const std::size_t first = static_cast<std::size_t>(task) * kShare;
    for (std::size_t i = first; i < std::min(first + kShare, pixels.size()); ++i)
      frame.pixels[i] = score_pixel(pixels[i], reference[i], map_width, map_height);
  });
  frame.score.pixels = static_cast<decltype(frame.score.pixels)>(
      std::ranges::count_if(frame.pixels, [](const PixelScore& score) { return score.verdict != Verdict::no_ray; }));
  std::vector<float> values;
  values.reserve(pixels.size());
  each_metric<OfPixels>(frame.score, [&](const Metric& metric, OfPixels function, const auto& numbers) {
    std::ranges::fill(numbers, 0);
    if (frame.score.pixels == 0) return;
    values.clear();
    function({.traced = pixels, .scores = frame.pixels}, values);
    fill_in(metric, values, numbers);
  });
  return frame;
}

void judge_pictures(const PicturePair& pictures, std::span<const PixelScore> mask, FrameScore& score) {
  each_metric<OfPictures>(score, [&](const Metric&, OfPictures function, const auto& numbers) {
    numbers.front() = function(pictures, mask);
  });
}

void MotionJudge::add(const FlickerFrame& before, const FlickerFrame& now) {
  for (std::size_t i = 0; i < kMetrics.size(); ++i) {
    const auto* function = std::get_if<OfMotion>(&kMetrics.at(i).function);
    if (function == nullptr) continue;
    const std::optional<double> value = (*function)(before, now);
    sums_.at(i).sum += value.value_or(0);
    sums_.at(i).count += value ? 1 : 0;
  }
}

void MotionJudge::fill_in(FrameScore& score) const {
  each_metric<OfMotion>(score, [&](const Metric& metric, OfMotion, const auto& numbers) {
    const Sum& total = sums_.at(static_cast<std::size_t>(&metric - kMetrics.data()));
    if (total.count > 0) numbers.front() = total.sum / total.count;
  });
}

}  // namespace reliefbench
