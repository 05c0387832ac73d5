#include "tuner/measure/harness.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <exception>
#include <map>
#include <sstream>
#include <string>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

/// Google Benchmark takes its flags from BENCHMARK_* in the environment as the program starts; ours are these, whatever
/// stands there. returns: true
bool set_flags() {
  std::array<std::string, 16> words{"reliefbench",
                                    "--benchmark_list_tests=false",
                                    "--benchmark_filter=",
                                    "--benchmark_repetitions=1",
                                    "--benchmark_min_warmup_time=0",
                                    "--benchmark_enable_random_interleaving=false",
                                    "--benchmark_report_aggregates_only=false",
                                    "--benchmark_display_aggregates_only=false",
                                    "--benchmark_format=console",
                                    "--benchmark_out_format=json",
                                    "--benchmark_out=",
                                    "--benchmark_color=auto",
                                    "--benchmark_counters_tabular=false",
                                    "--benchmark_perf_counters=",
                                    "--benchmark_time_unit=ns",
                                    "--v=0"};
  std::array<char*, words.size()> arguments{};
  std::ranges::transform(words, arguments.begin(), [](std::string& word) { return word.data(); });
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  // Else benchmark.json has them.
  benchmark::BenchmarkReporter::Context::executable_name = nullptr;
  if (auto* const context = benchmark::internal::GetGlobalContext()) context->clear();
  return true;
}

/// Hands on what Google Benchmark reports, as soon as it does, and prints nothing.
class ForwardingReporter : public benchmark::BenchmarkReporter {
 public:
  ForwardingReporter(std::size_t batches, const std::function<void(std::size_t, double)>& on_time)
      : batches_(batches), on_time_(on_time) {}
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      if (next_ == batches_) fail_environment("Google Benchmark ran more than the {} batches of a round", batches_);
      on_time_(next_++, run.GetAdjustedRealTime());
    }
  }

 private:
  std::size_t batches_;
  const std::function<void(std::size_t, double)>& on_time_;
  std::size_t next_ = 0;
};

}  // namespace

void run_round(std::span<const TimedBatch> batches, const std::function<void(std::size_t, double)>& on_time) {
  [[maybe_unused]] static const bool kHasFlags = set_flags();
  std::exception_ptr failure;
  benchmark::ClearRegisteredBenchmarks();
  for (const TimedBatch& batch : batches) {
    benchmark::RegisterBenchmark(batch.name.c_str(),
                                 [&failure, &batch](benchmark::State& state) {
                                   while (state.KeepRunningBatch(batch.frames)) {
                                     if (failure) {  // after a failure the rest is not run
                                       state.SkipWithError("skipped");
                                       break;
                                     }
                                     try {
                                       state.SetIterationTime(batch.run_ns() * 1e-9);
                                     } catch (...) {
                                       failure = std::current_exception();
                                       state.SkipWithError("failed");
                                       break;
                                     }
                                   }
                                 })
        ->Iterations(batch.frames)
        ->UseManualTime()
        ->Unit(benchmark::kNanosecond);
  }
  ForwardingReporter reporter(batches.size(), on_time);
  benchmark::RunSpecifiedBenchmarks(&reporter, nullptr, ".*");
  benchmark::ClearRegisteredBenchmarks();
  if (failure) std::rethrow_exception(failure);
}

void write_benchmark_json(std::span<const Sample> samples, std::ostream& out) {
  std::map<std::string, std::vector<const Sample*>> by_case;
  for (const Sample& sample : samples) by_case[sample.case_id].push_back(&sample);

  std::ostringstream ignored;
  benchmark::JSONReporter reporter;
  reporter.SetOutputStream(&out);
  reporter.SetErrorStream(&ignored);
  const benchmark::BenchmarkReporter::Context context;
  reporter.ReportContext(context);
  std::int64_t family = 0;  // Google Benchmark leaves it as it was in memory
  for (const auto& [id, list] : by_case) {
    std::int64_t repetition = 0;
    for (const Sample* sample : list) {
      benchmark::BenchmarkReporter::Run run;
      run.run_name.function_name = id;
      run.family_index = family;
      run.per_family_instance_index = 0;
      run.iterations = sample->frames;
      run.repetitions = static_cast<int64_t>(list.size());
      run.repetition_index = repetition++;
      run.threads = 1;
      run.time_unit = benchmark::kNanosecond;
      run.real_accumulated_time = sample->frame_time_ns * 1e-9 * sample->frames;
      run.cpu_accumulated_time = 0;
      reporter.ReportRuns({run});  // a Run takes a kilobyte
    }
    ++family;
  }
  reporter.Finalize();
}

}  // namespace reliefbench
