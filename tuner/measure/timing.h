#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kernels/base/error.h"
#include "tuner/measure/harness.h"
#include "tuner/measure/prepare.h"
#include "tuner/plan/config.h"
#include "tuner/results/case_mark.h"
#include "tuner/results/relative_time.h"

namespace reliefbench {

/// What timing a block needs besides its cases.
struct TimingContext {
  Session& session;
  const MeasureSpec& measure;
  WallSplit& split;
  std::uint64_t seed;                                ///< of this block's shuffles
  const SamplesByCase& samples_so_far;               ///< of an earlier, interrupted start
  CaseMark& mark;                                    ///< of the case that is being drawn
  std::function<double()> clock_ns;                  ///< Sample::at_ns
  std::function<void(const Sample&)> on_sample;      ///< called, and safe on disk, before the next batch is drawn
  std::function<void(double fraction)> on_progress;  ///< of the block
};

/// Thrown where a batch of frames fails.
struct BatchFailed {
  PreparedCase* owner = nullptr;  ///< null: the control case
  Error error;
};

/// Draws batches until two in a row agree within 5 %, or as often as `measure` allows.
/// returns: frames that make a batch of the asked length
[[nodiscard]] int warm_up(Session& session, const Draw& draw, const MeasureSpec& measure);

/// The batches in their order, with one of the control case before them, after them and between, after every `every`:
/// what relative_times() needs on either side of each.
[[nodiscard]] std::vector<TimedBatch> with_control(std::span<const TimedBatch> batches, const TimedBatch& control,
                                                   int every);

/// Samples a block of prepared cases: warm-up of each, then rounds in which every case is drawn once, in an order
/// shuffled anew, with the control case first, last and between.
/// throws: BatchFailed: samples taken before count; whatever on_sample throws
void time_block(const std::vector<PreparedCase*>& cases, const TimingContext& context);

}  // namespace reliefbench
