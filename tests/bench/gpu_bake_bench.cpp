#include <benchmark/benchmark.h>

#include <memory>
#include <string>
#include <vector>

#include "backends/gpu_bake.h"
#include "tests/cone_test_maps.h"

namespace reliefbench {
namespace {

constexpr int kSide = 256;

BakeRequest request_of(const Heightfield& heights, MapKind kind) {
  return {.heights = heights, .wrap = Wrap::repeat, .correction = find_map(kind).corrections.front()};
}

Heightfield heights_of(MapKind kind) {
  Heightfield heights = fbm_map(kSide, kSide);
  if (!find_map(kind).is_solid) return heights;
  heights.floors = noise_map(kSide, kSide).texels;
  for (std::size_t i = 0; i < heights.floors.size(); ++i) heights.floors[i] *= heights.texels[i];
  return heights;
}

void bake_on_cpu(benchmark::State& state, MapKind kind) {
  const Heightfield heights = heights_of(kind);
  std::vector<float> map;
  while (state.KeepRunning()) benchmark::DoNotOptimize(map = find_map(kind).bake(request_of(heights, kind)));
}

void bake_on_gpu(benchmark::State& state, const BackendRow& row, MapKind kind) {
  const Heightfield heights = heights_of(kind);
  const std::unique_ptr<Backend> backend = row.open(0, {});
  const GpuBaker baker(*backend, row.dialect, kind);
  GpuBake map;
  while (state.KeepRunning()) benchmark::DoNotOptimize(map = baker.bake(request_of(heights, kind)));
}

/// Lines read gpu_bake/map/device; a ratio is that of two lines of one run.
const bool kGpuAdded = [] {
  const auto add = [](const std::string& name, const auto& bake) {
    benchmark::RegisterBenchmark(("gpu_bake/" + name).c_str(), bake)->Unit(benchmark::kMillisecond)->UseRealTime();
  };
  for (const MapKind kind : gpu_bakers()) {
    const std::string id(find_map(kind).id);
    add(id + "/cpu", [kind](benchmark::State& state) { bake_on_cpu(state, kind); });
    for (const BackendRow& row : backends())
      if (row.real && !row.devices().empty())
        add(id + "/" + std::string(row.id), [&row, kind](benchmark::State& state) { bake_on_gpu(state, row, kind); });
  }
  return true;
}();

}  // namespace
}  // namespace reliefbench
