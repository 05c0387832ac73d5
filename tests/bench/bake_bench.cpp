#include <benchmark/benchmark.h>

#include <numeric>
#include <vector>

#include "kernels/cone_map.h"
#include "tests/bench/brute_cone_map.h"
#include "tests/bench/quick_cone_map.h"
#include "tests/cone_test_maps.h"

namespace reliefbench {
namespace {

using MakeMap = Heightfield (*)(int width, int height);

/// Mean ratio, and where the exact ratios are known the share of texels that are wider than those, which must be 0.
void report(benchmark::State& state, const Heightfield& heights, const std::vector<float>& ratios,
            const std::vector<float>& exact = {}) {
  state.counters["mean_ratio"] =
      std::accumulate(ratios.begin(), ratios.end(), 0.0) / static_cast<double>(ratios.size());
  if (exact.empty()) return;
  int wider = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) wider += ratios[i] > exact[i] * (1 + 1e-6F) ? 1 : 0;
  state.counters["too_wide"] = wider / static_cast<double>(heights.texels.size());
}

void bake_exact(benchmark::State& state, MakeMap make_heights, Wrap wrap, Correction correction, int threads) {
  const Heightfield heights = make_heights(static_cast<int>(state.range(0)), static_cast<int>(state.range(0)));
  const BakeRequest request{.heights = heights, .wrap = wrap, .correction = correction, .threads = threads};
  std::vector<float> ratios;
  while (state.KeepRunning()) benchmark::DoNotOptimize(ratios = bake_conservative(request));
  report(state, heights, ratios);
}

void bake_relaxed(benchmark::State& state, MakeMap make_heights, int threads) {
  const Heightfield heights = make_heights(static_cast<int>(state.range(0)), static_cast<int>(state.range(0)));
  std::vector<float> ratios;
  while (state.KeepRunning()) {
    benchmark::DoNotOptimize(ratios = bake_relaxed_po07({.heights = heights, .wrap = Wrap::clamp, .threads = threads}));
  }
  report(state, heights, ratios);
}

void bake_baseline(benchmark::State& state, MakeMap make_heights,
                   std::vector<float> (*bake)(const Heightfield& heights)) {
  const Heightfield heights = make_heights(static_cast<int>(state.range(0)), static_cast<int>(state.range(0)));
  std::vector<float> ratios;
  while (state.KeepRunning()) benchmark::DoNotOptimize(ratios = bake(heights));
  report(state, heights, ratios, bake_conservative({.heights = heights, .wrap = Wrap::clamp}));
}

/// Lines read algorithm/map_threads/side; a speed-up is the ratio of two lines of one run.
// NOLINTNEXTLINE(cppcoreguidelines-macro-usage): Google Benchmark registers by macro
#define BAKE_BENCHMARKS(map)                                                                  \
  BENCHMARK_CAPTURE(bake_exact, map##_1_thread, map##_map, Wrap::clamp, Correction::none, 1)  \
      ->RangeMultiplier(2)                                                                    \
      ->Range(256, 2048)                                                                      \
      ->Unit(benchmark::kMillisecond);                                                        \
  BENCHMARK_CAPTURE(bake_exact, map##_2_threads, map##_map, Wrap::clamp, Correction::none, 2) \
      ->RangeMultiplier(2)                                                                    \
      ->Range(256, 2048)                                                                      \
      ->UseRealTime()                                                                         \
      ->Unit(benchmark::kMillisecond);                                                        \
  BENCHMARK_CAPTURE(bake_exact, map##_repeat, map##_map, Wrap::repeat, Correction::none, 1)   \
      ->Arg(256)                                                                              \
      ->Arg(1024)                                                                             \
      ->Unit(benchmark::kMillisecond);                                                        \
  BENCHMARK_CAPTURE(bake_exact, map##_safe, map##_map, Wrap::clamp, Correction::safe, 1)      \
      ->Arg(256)                                                                              \
      ->Arg(1024)                                                                             \
      ->Unit(benchmark::kMillisecond);                                                        \
  BENCHMARK_CAPTURE(bake_baseline, map##_quick, map##_map, quick_cone_map)                    \
      ->RangeMultiplier(2)                                                                    \
      ->Range(256, 2048)                                                                      \
      ->Unit(benchmark::kMillisecond);                                                        \
  BENCHMARK_CAPTURE(bake_baseline, map##_brute_force, map##_map, brute_cone_map)              \
      ->Arg(256)                                                                              \
      ->Iterations(1)                                                                         \
      ->Unit(benchmark::kMillisecond);                                                        \
  BENCHMARK_CAPTURE(bake_relaxed, map##_1_thread, map##_map, 1)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond)
BAKE_BENCHMARKS(fbm);
BAKE_BENCHMARKS(bricks);
BAKE_BENCHMARKS(spikes);

}  // namespace
}  // namespace reliefbench
