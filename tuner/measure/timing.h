#pragma once
#include <functional>
#include <map>
#include <span>
#include <string>

#include "kernels/base/error.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/run_clock.h"
#include "tuner/measure/sample_book.h"
#include "tuner/measure/session.h"
#include "tuner/plan/config.h"
#include "tuner/results/case_mark.h"

namespace reliefbench {

/// A case that does not draw, found out when it was to be timed. Where Session::is_lost() says so, the device is to be
/// opened again.
class CaseFailed : public Error {
 public:
  explicit CaseFailed(Record failed) : Error(Exit::environment, failed.reason), record(std::move(failed)) {}
  Record record;
};

/// What the times of a technique are multiplied by, as they are drawn: a regression that was put in, to see that it is
/// found. A run says so.
using Slowdowns = std::map<std::string, double, std::less<>>;

/// So often a device that was lost over the control case, which is no case's fault, is opened again.
inline constexpr int kMostLostByControl = 3;

/// What timing needs besides its cases.
struct Timing {
  Session& session;
  SampleBook& book;
  const MeasureSpec& measure;
  WallSplit& split;
  CaseMark* mark = nullptr;              ///< of the case that is being drawn; null where no run is kept
  const Slowdowns* slowdowns = nullptr;  ///< null: none
  RunClock clock{};                      ///< of Sample::at_ns
  double cooling_pause_s = 0;            ///< of draw_block()
  Progress* progress = nullptr;          ///< shows that pause; null: nothing does
};

/// A case that was warmed up. Record and draws outlive it.
struct TimedCase {
  const Record* record = nullptr;
  std::span<const Draw> draws{};  ///< of a frame
  int frames = 1;                 ///< of a batch
};

/// Draws batches until two in a row agree within 5 %, or as often as `measure` allows; then it is known how many frames
/// make a batch of the asked length. throws: CaseFailed
[[nodiscard]] TimedCase warm_up(const Timing& timing, const Record& record, std::span<const Draw> draws);

/// Frames -> samples, into the book: one batch of each case in this order, with one of the control case first, last and
/// after every `control_every`: what relative_times() needs on either side of each. A case may be there more than once.
/// throws: CaseFailed; Error: the control case's own, or the book's. Samples taken before count
void time(const Timing& timing, std::span<const TimedCase> round);

}  // namespace reliefbench
