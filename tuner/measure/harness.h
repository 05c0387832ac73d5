#pragma once
#include <functional>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "tuner/results/record.h"

namespace reliefbench {

/// One batch of frames to be timed.
struct TimedBatch {
  std::string name;
  int frames = 1;
  std::function<double()> run_ns;  ///< draws the frames, returns the batch's time
};

/// Runs the batches once each, in order, as Google Benchmark benchmarks with manual time and explicit iterations
/// (one iteration a frame). on_time: called after each batch with its index and ns a frame, as Google Benchmark reports
/// it. throws: whatever a batch throws; the batches after it are not run
void run_round(std::span<const TimedBatch> batches, const std::function<void(std::size_t, double)>& on_time);

/// Every raw sample as one repetition, in Google Benchmark's own JSON, written by its own reporter.
void write_benchmark_json(std::span<const Sample> samples, std::ostream& out);

}  // namespace reliefbench
