// What a decision of the search costs at 3,000 settings. Bar: 5 ms.
#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "tuner/search/explore.h"
#include "tuner/search/gaps.h"
#include "tuner/search/likelihood.h"
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

/// The likelihood of 96 points once a weight was moved. times_eigen: how many times as fast as the same formulas by
/// Eigen.
void weight_move(benchmark::State& state) {
  constexpr Eigen::Index kPoints = 96;
  constexpr Eigen::Index kAxes = 25;
  constexpr Eigen::Index kPairs = kPoints * (kPoints - 1) / 2;
  Random random(1);
  Likelihood::Points points{.squared = Eigen::ArrayXXd(kPairs, kAxes),
                            .values = Eigen::VectorXd(kPoints),
                            .noise = Eigen::VectorXd::Constant(kPoints, 0.01)};
  for (double& squared : points.squared.reshaped()) squared = random.uniform();
  for (double& value : points.values) value = random.uniform();
  const Eigen::VectorXd weights = Eigen::VectorXd::Zero(kAxes + 1);
  const Eigen::ArrayXd sums = points.squared.rowwise().sum();
  const Eigen::ArrayXd additive = (1 / (1 + points.squared)).rowwise().sum();
  const auto by_eigen = [&](double weight) {
    const auto squared = points.squared.col(0);
    const Eigen::ArrayXd after = weight * squared;
    const Eigen::ArrayXd distance = (sums + after - squared).max(0);
    const Eigen::ArrayXd mean = (additive + 1 / (1 + after) - 1 / (1 + squared)) / kAxes;
    const Eigen::ArrayXd r = (5 * distance).sqrt();
    const Eigen::ArrayXd kernel = 0.5 * mean + 0.5 * (1 + r + r.square() / 3) * (-r).exp();
    Eigen::MatrixXd matrix(kPoints, kPoints);
    Eigen::Index first = 0;
    for (Eigen::Index b = 0; b < kPoints; ++b) {
      const Eigen::Index below = kPoints - b - 1;
      matrix.col(b).tail(below) = kernel.segment(first, below).matrix();
      matrix(b, b) = 1.01;
      first += below;
    }
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> cholesky(matrix);
    benchmark::DoNotOptimize(cholesky.matrixL().solve(points.values).eval().squaredNorm());
  };
  Likelihood likelihood(points, weights);
  const auto seconds_of = [](const auto& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  double ours_s = 0;
  double eigen_s = 0;
  for (auto _ : state) {
    const double weight = 1 + random.uniform();
    ours_s += seconds_of([&] { benchmark::DoNotOptimize(likelihood.improve(0, std::log(weight))); });
    eigen_s += seconds_of([&] { by_eigen(weight); });
  }
  state.counters["times_eigen"] = eigen_s / ours_s;
}
BENCHMARK(weight_move)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace reliefbench
