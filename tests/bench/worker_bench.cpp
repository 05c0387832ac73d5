// What a device in a process of its own costs beside one in this process: its start, a batch of no work, bytes up and
// down (the null device does next to nothing itself), and whether its frames' times are the same (A/A).
#include <benchmark/benchmark.h>
#include <time.h>

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "backends/shader_compiler.h"
#include "backends/worker/remote.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

std::unique_ptr<Backend> null_device(bool in_worker) {
  const BackendRow& row = find_backend("null");
  return in_worker ? open_remote(std::make_unique<Worker>(RELIEFBENCH_BINARY), row, 0, {}) : row.open(0, {});
}

void start(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(null_device(true));
}
BENCHMARK(start)->Name("worker/start_and_end")->Unit(benchmark::kMillisecond)->UseRealTime();

/// A batch of one pixel.
void batch(benchmark::State& state, bool in_worker) {
  const auto device = null_device(in_worker);
  const auto pipeline =
      device->compile({.label = "flat", .vertex = {}, .fragment = {}, .constants = {}, .target = Target::color});
  Draw draw{.pipeline = pipeline.get()};
  draw.frame.sizes = {1, 1, 1, 1};
  for (auto _ : state) benchmark::DoNotOptimize(device->render(draw, 1, Timer::fenced_wall));
}
BENCHMARK_CAPTURE(batch, null_in_process, false)->Name("worker/batch/in_process")->UseRealTime();
BENCHMARK_CAPTURE(batch, null_in_worker, true)->Name("worker/batch/in_worker")->UseRealTime();

void upload(benchmark::State& state, bool in_worker) {
  const auto device = null_device(in_worker);
  const auto side = static_cast<int>(state.range(0));
  const std::vector<std::byte> texels(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) * 4);
  benchmark::DoNotOptimize(device->upload({.width = side, .height = side, .texels = texels}));
  for (auto _ : state) benchmark::DoNotOptimize(device->upload({.width = side, .height = side, .texels = texels}));
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(texels.size()));
}
BENCHMARK_CAPTURE(upload, in_process, false)->Name("worker/upload/in_process")->Arg(256)->Arg(4096)->UseRealTime();
BENCHMARK_CAPTURE(upload, in_worker, true)->Name("worker/upload/in_worker")->Arg(256)->Arg(4096)->UseRealTime();

/// RGBA8 of 16:9; the null device paints it first.
void read_back(benchmark::State& state, bool in_worker) {
  const auto device = null_device(in_worker);
  const auto pipeline =
      device->compile({.label = "flat", .vertex = {}, .fragment = {}, .constants = {}, .target = Target::color});
  const auto height = static_cast<int>(state.range(0));
  Draw draw{.pipeline = pipeline.get()};
  draw.frame.sizes = {height * 16 / 9, height, 1, 1};
  device->render(draw, 1, Timer::fenced_wall);
  std::vector<std::uint8_t> picture;
  device->read_color(picture);  // memory is fresh the first time
  for (auto _ : state) device->read_color(picture);
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(picture.size()));
}
BENCHMARK_CAPTURE(read_back, in_process, false)
    ->Name("worker/read_back/in_process")
    ->Arg(720)
    ->Arg(2160)
    ->UseRealTime();
BENCHMARK_CAPTURE(read_back, in_worker, true)->Name("worker/read_back/in_worker")->Arg(720)->Arg(2160)->UseRealTime();

/// Batches of known work by the wall clock, on the device in this process and on that in a worker, in turns: A B B A.
/// `ratio`: worker against process, the median over the rounds, with its interval. `cpu_ratio`: of the processor time
/// of both processes, which a busy machine disturbs less; of software rasterisers it is that of the frames.
void same_times(benchmark::State& state, const char* backend) {
  const BackendRow& row = find_backend(backend);
  if (row.devices().empty()) return state.SkipWithError("no device");
  struct Device {
    std::unique_ptr<Backend> backend;
    std::unique_ptr<Pipeline> pipeline;
    Draw draw;
    clockid_t clock = CLOCK_PROCESS_CPUTIME_ID;
    double cpu_ns = 0;
  };
  std::array<Device, 2> devices;
  for (const bool in_worker : {false, true}) {
    Device& device = devices.at(in_worker ? 1 : 0);
    if (in_worker) {
      auto worker = std::make_unique<Worker>(RELIEFBENCH_BINARY);
      clock_getcpuclockid(worker->process(), &device.clock);
      device.backend = open_remote(std::move(worker), row, 0, {});
    } else {
      device.backend = row.open(0, {});
    }
    device.pipeline = device.backend->compile({.label = "load",
                                               .vertex = compile_vertex(row.dialect, "fullscreen"),
                                               .fragment = compile_load(row.dialect),
                                               .constants = {{.id = 0, .value = 256}},
                                               .target = Target::color});
    device.draw = {.pipeline = device.pipeline.get()};
    device.draw.frame.sizes = {256, 256, 1, 1};
    device.backend->render(device.draw, 2, Timer::fenced_wall);
  }
  const auto frames = static_cast<int>(state.range(0));
  const auto cpu_ns = [](const Device& device) {
    timespec now{};
    clock_gettime(device.clock, &now);
    return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
  };
  const auto ns = [&](std::size_t place) {
    Device& device = devices.at(place);
    const double before_ns = cpu_ns(device);
    const double wall_ns = device.backend->render(device.draw, frames, Timer::fenced_wall).wall_ns;
    device.cpu_ns += cpu_ns(device) - before_ns;
    return wall_ns;
  };
  std::vector<double> ratios;
  for (auto _ : state) {
    const double first = ns(0);
    const double worker = ns(1) + ns(1);
    ratios.push_back(worker / (first + ns(0)));
  }
  const Summary ratio = summarise(ratios);
  state.counters["ratio"] = ratio.median;
  state.counters["low"] = ratio.ci_low;
  state.counters["high"] = ratio.ci_high;
  state.counters["cpu_ratio"] = devices[1].cpu_ns / devices[0].cpu_ns;
  state.counters["rounds"] = static_cast<double>(ratios.size());
}
BENCHMARK_CAPTURE(same_times, opengl, "opengl")->Name("worker/same_times/opengl")->Arg(1)->Arg(4)->Iterations(200);
BENCHMARK_CAPTURE(same_times, vulkan, "vulkan")->Name("worker/same_times/vulkan")->Arg(1)->Arg(4)->Iterations(200);

}  // namespace
}  // namespace reliefbench
