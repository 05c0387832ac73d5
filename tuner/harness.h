#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "tuner/record.h"

namespace reliefbench {

/// One batch of frames to be timed.
struct TimedBatch {
  std::string name;
  int frames = 1;
  std::function<double()> run_ns;  ///< draws the frames, returns the batch's time
};

/// Runs the batches once each, in order, as Google Benchmark benchmarks with manual time and explicit iterations
/// (one iteration a frame). returns: ns a frame, as Google Benchmark reports them, parallel to `batches`
/// throws: whatever a batch throws
[[nodiscard]] std::vector<double> run_round(std::span<const TimedBatch> batches);

/// Every raw sample as one repetition, in Google Benchmark's own JSON, written by its own reporter.
[[nodiscard]] std::string benchmark_json(std::span<const Sample> samples);

}  // namespace reliefbench
