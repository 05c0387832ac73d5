#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "tuner/measure/timing.h"

namespace reliefbench {

/// What is timed in turns for an answer, without a run's folder.
struct TurnsBench {
  Session& session;
  const MeasureSpec& measure;
  WallSplit& split;
  Progress& progress;
  double cooling_pause_s;
};

struct TimesInTurns {
  std::string held_back{};                      ///< what says that the device was, again and again; "": it was not
  std::vector<std::vector<double>> times_ns{};  ///< of each case a frame's in each round; none where it was held back
};

/// Warms cases up, then draws each once a round, in an order that is shuffled anew, in a block of draw_block(). Times
/// are corrected for drift.
/// cases: with different ids; how many frames a batch has is found out. on_round: called after each, from 1
/// throws: as warm_up() and time()
[[nodiscard]] TimesInTurns timed_in_turns(
    const TurnsBench& bench, std::span<const TimedCase> cases, const std::function<void(int)>& on_round = [](int) {});

}  // namespace reliefbench
