#pragma once
#include <vector>

#include "tuner/decide/seen_event.h"

namespace reliefbench {

// What no test is needed for: cases that changed for certain.

/// Deterministic metrics that have other values from one night to the next, as one event a machine and night, of the
/// cases that have not had the values from before it again; where all have, it is recovered. The way back is none,
/// unless the change that it undoes was accepted.
[[nodiscard]] std::vector<SeenEvent> changed_errors(const HistoryView& view);

/// Cases that were ok once and failed in the last night that tried them; confirmed from the second such night on, and
/// not told before where the failure is one that may pass.
[[nodiscard]] std::vector<SeenEvent> lost_cases(const HistoryView& view);

}  // namespace reliefbench
