#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "tuner/decide/events.h"
#include "tuner/decide/seen_event.h"
#include "tuner/decide/track.h"
#include "tuner/history/rows.h"

namespace reliefbench {

struct StepCheck {
  std::vector<SeenEvent> events;
  std::vector<EpochChanges> epochs;
  double case_shift = 0;
};

/// Steps and drifts. A device's nights are looked at epoch by epoch (epochs.h); once as they are, and once without what
/// all cases of a night share.
[[nodiscard]] StepCheck check_steps(const HistoryView& view, const EventOptions& options);

}  // namespace reliefbench
