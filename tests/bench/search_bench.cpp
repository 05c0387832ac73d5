// What a decision of the search costs at 3,000 settings. Bar: 5 ms.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "tuner/search/explore.h"
#include "tuner/search/gaps.h"
#include "tuner/search/noise.h"
#include "tuner/search/observations.h"
#include "tuner/search/random.h"

namespace reliefbench {
namespace {

constexpr std::size_t kSettings = 3000;

/// Ten techniques, 20 chains each, lattices of 5 x 3 step counts.
SearchSpace space() {
  SearchSpace space{
      .category_axes = {"technique", "format", "filter"}, .step_axes = {"march", "refinement"}, .candidates = {}};
  for (std::size_t i = 0; i < kSettings; ++i) {
    const auto digit = [&](std::size_t of, std::size_t base) { return static_cast<int>(i / of % base); };
    const double march = 8 * std::exp2(digit(1, 5));
    const double refinement = digit(5, 3);
    space.candidates.push_back(
        {.id = std::to_string(i),
         .categories = {digit(15, 10), digit(150, 10), digit(1500, 2)},
         .steps = {march, refinement},
         .error = (1 + 0.01 * digit(150, 10) + 0.1 * digit(15, 10)) / (march * (1 + refinement))});
  }
  return space;
}

double log_time(const Candidate& candidate) {
  return std::log(1e6 + 1e5 * candidate.steps[0] * (1 + 0.1 * candidate.categories[0]) + 2e5 * candidate.steps[1]) +
         0.01 * candidate.categories[1];
}

/// A setting chosen, with so many timed. Its share of a batch, as the search asks for whole ones.
void decision(benchmark::State& state) {
  const SearchSpace settings = space();
  const auto timed = static_cast<std::size_t>(state.range(0));
  std::vector<Observed> observed(kSettings);
  const std::vector<double> scales(kSettings, 0.01);
  Random random(1);
  for (int order = 0; static_cast<std::size_t>(order) < timed;) {
    const std::size_t i = random.below(kSettings);
    if (observed[i].is_measured()) continue;
    const double time = log_time(settings.candidates[i]);
    observed[i].add({time, time, time});
    observed[i].order = order++;
    observed[i].mean = observed[i].clipped = time;
  }
  Explorer explorer(settings);
  (void)explorer.propose(observed, scales);  // learns what was timed; afterwards a batch is added at a time
  std::size_t chosen = 0;
  for (auto _ : state) {
    const std::vector<std::size_t> batch = explorer.propose(observed, scales);
    benchmark::DoNotOptimize(batch.data());
    chosen += batch.size();
  }
  state.counters["s_per_decision"] =
      benchmark::Counter(static_cast<double>(chosen), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(decision)->Arg(50)->Arg(150)->Arg(290)->Unit(benchmark::kMillisecond);

/// One setting's bounds changed and the widest gap found anew.
void gap_update(benchmark::State& state) {
  const SearchSpace settings = space();
  Gaps gaps(settings);
  Random random(1);
  for (std::size_t i = 0; i < kSettings; ++i) {
    const double time = log_time(settings.candidates[i]);
    gaps.set(i, time - 0.05 * random.uniform(), time + 0.05 * random.uniform());
  }
  for (auto _ : state) {
    const std::size_t i = random.below(kSettings);
    gaps.set(i, gaps.lower(i), gaps.upper(i) + 1e-9);
    benchmark::DoNotOptimize(gaps.widest());
  }
}
BENCHMARK(gap_update)->Unit(benchmark::kMicrosecond);

/// Noise estimated anew and the bounds of all settings with it: so many were timed, two to eleven blocks each.
void refit(benchmark::State& state) {
  const SearchSpace settings = space();
  std::vector<Observed> observed(static_cast<std::size_t>(state.range(0)));
  Random random(1);
  for (std::size_t i = 0; i < observed.size(); ++i) {
    observed[i].order = static_cast<int>(i);
    for (std::size_t block = 0; block < 2 + i % 10; ++block) {
      std::array<double, kBlock> frames{};
      for (double& frame : frames) frame = log_time(settings.candidates[i]) + 0.03 * random.uniform();
      observed[i].add(frames);
    }
  }
  NoiseModel noise(kSettings, 0.95);
  for (auto _ : state) {
    noise.fit(observed);
    for (Observed& setting : observed) benchmark::DoNotOptimize(noise.bound(setting));
  }
}
BENCHMARK(refit)->Arg(150)->Arg(700)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace reliefbench
