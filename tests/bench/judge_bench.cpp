// Judging of a frame beside its plain form: lines read judge/what/form/height, frames are 16:9.
#include <benchmark/benchmark.h>

#include <random>

#include "kernels/base/memory.h"
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

/// As a sweep judges a case: the reference's features are made once a scene.
void judge_all(benchmark::State& state) {
  const Frame frame(static_cast<int>(state.range(0)));
  const FlipFeatures features = flip_features(frame.reference, frame.width, frame.height);
  PicturePair pair = frame.pair();
  pair.reference_features = &features;
  while (state.KeepRunning()) {
    JudgedFrame judged = judge(frame.pixels, frame.hits, 512, 512);
    judge_pictures(pair, judged.mask, judged.score);
    benchmark::DoNotOptimize(judged.score);
  }
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
BENCHMARK(pictures_fast)
    ->Name("judge/flip_and_ssim/vectorised")
    ->Arg(1080)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(pictures_plain)->Name("judge/flip_and_ssim/plain")->Arg(1080)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace reliefbench
