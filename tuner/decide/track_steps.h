#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "tuner/decide/events.h"
#include "tuner/decide/track.h"
#include "tuner/history/rows.h"

namespace reliefbench {

/// What one look at a history shows, without what earlier ones said of it. The row has no states yet.
struct SeenEvent {
  EventRow row;
  EventState state = EventState::suspect;
  std::string reason{};
};

struct StepCheck {
  std::vector<SeenEvent> events;
  std::vector<EpochChanges> epochs;
  double case_shift = 0;
};

/// Steps and drifts. A device's nights are looked at epoch by epoch (epochs.h); once as they are, and once without what
/// all cases of a night share.
[[nodiscard]] StepCheck check_steps(const HistoryView& view, const EventOptions& options);

/// Deterministic metrics that have other values from one night to the next, as one event a machine and night, of the
/// cases that have not had the values from before it again; where all have, it is recovered. The way back is none,
/// unless the change that it undoes was accepted.
[[nodiscard]] std::vector<SeenEvent> changed_errors(const HistoryView& view);

/// Cases that were ok once and failed in the last night that tried them; confirmed from the second such night on, and
/// not told before where the failure is one that may pass.
[[nodiscard]] std::vector<SeenEvent> lost_cases(const HistoryView& view);

}  // namespace reliefbench
