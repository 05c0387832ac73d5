#include <benchmark/benchmark.h>

#include <numeric>
#include <string>
#include <vector>

#include "kernels/maps/cone_map.h"
#include "tests/bench/brute_cone_map.h"
#include "tests/cone_test_maps.h"

namespace reliefbench {
namespace {

using MakeMap = Heightfield (*)(int width, int height);
using Bake = std::vector<float> (*)(const BakeRequest& request);

struct Variant {
  Wrap wrap = Wrap::clamp;
  Correction correction = Correction::none;
  int threads = 1;
};

void bake(benchmark::State& state, Bake bake_map, MakeMap make_heights, const Variant& variant) {
  const auto side = static_cast<int>(state.range(0));
  const Heightfield heights = make_heights(side, side);
  const BakeRequest request{
      .heights = heights, .wrap = variant.wrap, .correction = variant.correction, .threads = variant.threads};
  std::vector<float> ratios;
  while (state.KeepRunning()) benchmark::DoNotOptimize(ratios = bake_map(request));
  state.counters["mean_ratio"] =
      std::accumulate(ratios.begin(), ratios.end(), 0.0) / static_cast<double>(ratios.size());
}

std::vector<float> bake_conservative_by_brute_force(const BakeRequest& request) {
  return brute_cone_map(request.heights);
}
std::vector<float> bake_relaxed_by_brute_force(const BakeRequest& request) {
  return brute_relaxed_map(request.heights);
}

constexpr Variant kOneThread{};
constexpr Variant kTwoThreads{.threads = 2};
constexpr Variant kRepeat{.wrap = Wrap::repeat};
constexpr Variant kSafe{.correction = Correction::safe};

/// Lines read bake/algorithm/map/variant/side; a speed-up is the ratio of two lines of one run.
void add(const std::string& name, Bake bake_map, MakeMap make_heights, const Variant& variant,
         const std::vector<int>& sides) {
  auto* const benchmark = benchmark::RegisterBenchmark(
      ("bake/" + name).c_str(), [=](benchmark::State& state) { bake(state, bake_map, make_heights, variant); });
  for (const int side : sides) benchmark->Arg(side);
  benchmark->Unit(benchmark::kMillisecond);
  if (variant.threads > 1) benchmark->UseRealTime();
}

const bool kAdded = [] {
  constexpr ConeTestMap kMaps[] = {{"fbm", fbm_map}, {"bricks", bricks_map}, {"spikes", spikes_map}};
  for (const auto& [id, make_heights] : kMaps) {
    const auto named = [&, map = std::string(id)](const std::string& algorithm, const std::string& variant) {
      return algorithm + "/" + map + "/" + variant;
    };
    add(named("quick", "1_thread"), bake_quick, make_heights, kOneThread, {256, 512, 1024, 2048, 4096});
    add(named("conservative", "1_thread"), bake_conservative, make_heights, kOneThread, {256, 512, 1024, 2048, 4096});
    add(named("conservative", "2_threads"), bake_conservative, make_heights, kTwoThreads, {512, 1024, 2048});
    add(named("conservative", "safe"), bake_conservative, make_heights, kSafe, {512, 1024, 2048});
    add(named("conservative", "repeat"), bake_conservative, make_heights, kRepeat, {512, 1024});
    add(named("conservative_brute_force", "1_thread"), bake_conservative_by_brute_force, make_heights, kOneThread,
        {256});
    add(named("relaxed", "1_thread"), bake_relaxed, make_heights, kOneThread, {256, 512, 1024});
    add(named("relaxed", "2_threads"), bake_relaxed, make_heights, kTwoThreads, {256, 512});
    add(named("relaxed", "repeat"), bake_relaxed, make_heights, kRepeat, {256});
    add(named("relaxed_brute_force", "1_thread"), bake_relaxed_by_brute_force, make_heights, kOneThread, {256});
    add(named("relaxed_po07", "1_thread"), bake_relaxed_po07, make_heights, kOneThread, {128, 256});
    add(named("quad", "1_thread"), bake_quad, make_heights, kOneThread, {256, 1024});
    add(named("safety_shape", "1_thread"), bake_safety_shape, make_heights, kOneThread, {256, 1024});
  }
  return true;
}();

}  // namespace
}  // namespace reliefbench
