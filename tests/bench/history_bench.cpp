// What a night costs the history: of 1,500 cases with ten samples each, as a run folder.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "kernels/base/sha256.h"
#include "tests/hand_made.h"
#include "tests/written_run.h"
#include "tuner/history/ingest.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

constexpr int kCases = 1500;
constexpr int kSamples = 10;

/// A folder that goes with the process.
const fs::path& bench_folder() {
  static const struct Folder {
    Folder() { fs::create_directories(path); }
    ~Folder() { fs::remove_all(path); }
    fs::path path = fs::temp_directory_path() / ("reliefbench_history_bench_" + std::to_string(::getpid()));
  } folder;
  return folder.path;
}

/// night: its number, so that nights differ
Run night_run(int night) {
  Run run;
  run.folder = bench_folder() / ("night" + std::to_string(night));
  run.info = {{"identity", {{"schema", kSchemaVersion}, {"night", night}}},
              {"started_unix_ns", 1e9 * (1'700'000'000.0 + 86'400.0 * night)},
              {"finished", "2026-11-22T12:07:31Z"},
              {"git_sha", "15450c1"},
              {"host", {{"name", "farm"}, {"cpu", "a CPU"}, {"os", "an OS"}}},
              {"devices",
               {{{"backend", "null"},
                 {"name", "device"},
                 {"driver", "driver"},
                 {"timer", "fenced_wall"},
                 {"audit", {{{"timer", "fenced_wall"}, {"valid", true}}}}}}}};
  double at_ns = 0;
  const auto add = [&](const std::string& id, int round, double time_ns) {
    run.samples.push_back(
        {.case_id = id, .round = round, .frames = 3, .frame_time_ns = time_ns, .at_ns = at_ns += 1e6});
  };
  for (int i = 0; i < kCases; ++i) {
    const std::string id = fmt::format("relief@rocks/top?linear_steps={}&refinement=none&format=r8&backend=null", i);
    run.records.push_back(make_record({.case_id = id, .time_ns = 1000.0 + i, .e_xy_p99 = i / 7.0}));
    run.records.back().scene_key.hex = std::string(64, 'a');
    run.records.back().timing_key = sha256(id);
    for (int round = 0; round < kSamples; ++round) {
      if (round % 5 == 0) add("control@null", 0, 812'345);
      add(id, round, (1000.0 + i) * (1 + 0.001 * ((round * 7 + night) % 10)) / 3);
    }
  }
  return run;
}

/// The figure that counts: a run's folder into a new history in a file.
void ingest_into_sqlite(benchmark::State& state) {
  const Run run = night_run(1);
  write_run(run);
  const fs::path file = bench_folder() / "history.db";
  for (auto _ : state) {
    History(file.string(), History::Access::write).add(read_night(run.folder, {}));
    state.PauseTiming();
    fs::remove(file);
    state.ResumeTiming();
  }
  state.counters["cases"] = kCases;
}
BENCHMARK(ingest_into_sqlite)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Its first half.
void read_a_run(benchmark::State& state) {
  const Run run = night_run(1);
  write_run(run);
  for (auto _ : state) benchmark::DoNotOptimize(read_night(run.folder, {}).values.size());
}
BENCHMARK(read_a_run)->Unit(benchmark::kMillisecond)->UseRealTime();

/// A check's view of so many nights.
void load_nights(benchmark::State& state) {
  const fs::path file = bench_folder() / "nights.db";
  {
    write_run(night_run(1));
    Night night = read_night(night_run(1).folder, {});
    History history(file.string(), History::Access::write);
    for (int i = 0; i < state.range(0); ++i) {
      night.run.unix_s += 86'400;
      night.run.content = night.origin = std::to_string(i);
      history.add(night);
    }
    state.counters["bytes_a_night"] = static_cast<double>(fs::file_size(file)) / static_cast<double>(state.range(0));
  }
  const History history(file.string(), History::Access::read);
  for (auto _ : state) benchmark::DoNotOptimize(history.load({}).nights.size());
  fs::remove(file);
}
BENCHMARK(load_nights)->Arg(60)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace reliefbench
