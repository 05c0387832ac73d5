// Judging of a frame beside its plain form: lines read judge/what/form/height, frames are 16:9.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <variant>

#include "kernels/base/memory.h"
#include "kernels/judge/metric_values.h"
#include "kernels/judge/picture_metrics.h"
#include "kernels/judge/score.h"
#include "tests/slow_picture_metrics.h"

namespace reliefbench {
namespace {

[[maybe_unused]] const bool is_as_the_command = (keep_freed_memory(), true);

/// A frame of rays and hits that are off by up to 8 texels, and two pictures that differ by noise.
struct Frame {
  explicit Frame(int side) : width(side * 16 / 9), height(side) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    for (std::size_t i = 0; i < count; ++i) {
      const float t = unit(random);
      pixels.push_back({.ray = {.u = unit(random), .v = unit(random), .slope_u = 0.3F, .slope_v = 0.2F},
                        .t = t + 0.02F * unit(random) * unit(random),
                        .status = 1,
                        .taps = 20 * unit(random)});
      hits.push_back({.t_enter = static_cast<double>(t), .t_exit = static_cast<double>(t) + 0.05});
      for (int c = 0; c < 4; ++c) {
        const auto code = static_cast<std::uint8_t>(random());
        reference.push_back(code);
        test.push_back(static_cast<std::uint8_t>(code ^ (random() & 15U)));
      }
    }
  }
  [[nodiscard]] PicturePair pair() const {
    return {.reference = reference, .test = test, .width = width, .height = height};
  }

  int width, height;
  std::vector<ScorePixel> pixels;
  std::vector<ReferenceHit> hits;
  std::vector<std::uint8_t> reference, test;
};

/// That both forms find the same.
void show(benchmark::State& state, const FrameScore& score) {
  for (const char* id : {"e_xy.p99", "missed_rate", "psnr", "flip", "ssim"})
    for (const MetricRow& row : metrics())
      if (row.id == id) state.counters[id] = row.value(score).value_or(0);
}

/// As a sweep judges a case by all metrics: the reference's features are made once a scene. To be had in 60 ms at 1080p
/// and 240 ms at 4K, on two cores.
void judge_all(benchmark::State& state) {
  const Frame frame(static_cast<int>(state.range(0)));
  const FlipFeatures features = flip_features(frame.reference, frame.width, frame.height);
  PicturePair pair = frame.pair();
  pair.reference_features = &features;
  while (state.KeepRunning()) {
    JudgedFrame judged = judge(frame.pixels, frame.hits, 512, 512);
    judge_pictures(pair, judged.mask, judged.score);
    show(state, judged.score);
  }
}

/// A metric of pixels as plainly as it can be written: all values in order.
void put_plain(std::vector<float> values, std::span<const Aggregate> aggregates,
               std::span<std::optional<double>> into) {
  std::ranges::sort(values);
  const auto percentile = [&](double percent) {
    const auto rank = static_cast<std::size_t>(std::ceil(percent / 100 * static_cast<double>(values.size())));
    return values[std::max<std::size_t>(rank, 1) - 1];
  };
  for (std::size_t i = 0; i < aggregates.size(); ++i) {
    if (aggregates[i] == Aggregate::mean)
      into[i] = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
    else if (aggregates[i] == Aggregate::max)
      into[i] = values.back();
    else
      for (const auto& [aggregate, percent] : kPercentiles)
        if (aggregate == aggregates[i]) into[i] = percentile(percent);
  }
}

FrameScore judged_plainly(const Frame& frame) {
  PixelScores scores(frame.pixels.size());
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const ScorePixel& pixel = frame.pixels[i];
    const double travel_texels = std::hypot(512.0 * pixel.ray.slope_u, 512.0 * pixel.ray.slope_v);
    scores[i] = score_pixel(pixel, frame.hits[i], std::abs(pixel.t - frame.hits[i].t_enter) * travel_texels);
  }
  FrameScore score{.pixels = static_cast<std::int64_t>(scores.size())};
  const auto mean = [](const std::vector<float>& map) {
    return std::accumulate(map.begin(), map.end(), 0.0) / static_cast<double>(map.size());
  };
  std::size_t place = 0;
  for (const Metric& metric : kMetrics) {
    const std::span numbers = std::span(score.values).subspan(place, metric.aggregates.size());
    place += metric.aggregates.size();
    if (const auto* of_pixels = std::get_if<OfPixels>(&metric.function)) {
      UnfilledVector<float> values;
      (*of_pixels)({.traced = frame.pixels, .scores = scores}, values);
      put_plain({values.begin(), values.end()}, metric.aggregates, numbers);
    } else if (const auto* of_verdict = std::get_if<OfVerdict>(&metric.function);
               of_verdict && metric.feature.empty()) {
      const auto count =
          std::ranges::count_if(scores, [&](const PixelScore& one) { return (*of_verdict)(one.verdict); });
      numbers.front() = static_cast<double>(count) / static_cast<double>(scores.size());
    }
  }
  double squares = 0;
  for (std::size_t i = 0; i < frame.test.size(); ++i)
    if (i % 4 != 3) squares += std::pow(frame.test[i] - frame.reference[i], 2);
  score["psnr"] = 10 * std::log10(255 * 255 * 3 * static_cast<double>(scores.size()) / squares);
  score["flip"] = mean(slow::flip_map(frame.pair(), kPixelsPerDegree));
  score["ssim"] = mean(slow::ssim_map(frame.pair()));
  return score;
}

void judge_all_plain(benchmark::State& state) {
  const Frame frame(static_cast<int>(state.range(0)));
  while (state.KeepRunning()) show(state, judged_plainly(frame));
}

void pictures_fast(benchmark::State& state) {
  const Frame frame(static_cast<int>(state.range(0)));
  while (state.KeepRunning()) {
    benchmark::DoNotOptimize(flip_map(frame.pair()));
    benchmark::DoNotOptimize(ssim_map(frame.pair()));
  }
}

void pictures_plain(benchmark::State& state) {
  const Frame frame(static_cast<int>(state.range(0)));
  while (state.KeepRunning()) {
    benchmark::DoNotOptimize(slow::flip_map(frame.pair(), kPixelsPerDegree));
    benchmark::DoNotOptimize(slow::ssim_map(frame.pair()));
  }
}

BENCHMARK(judge_all)->Name("judge/all/vectorised")->Arg(1080)->Arg(2160)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(judge_all_plain)
    ->Name("judge/all/plain")
    ->Arg(1080)
    ->Arg(2160)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(pictures_fast)
    ->Name("judge/flip_and_ssim/vectorised")
    ->Arg(1080)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(pictures_plain)->Name("judge/flip_and_ssim/plain")->Arg(1080)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace reliefbench
