#pragma once
#include <optional>
#include <span>
#include <vector>

#include "tuner/decide/events.h"

namespace reliefbench {

/// The series without what all of a machine's backend share in a night: the median over its series of how far each is
/// from its own median. A night shifts many cases together (where memory lies, how the control case ran), by more than
/// each scatters; beside that, a step of a few shows much earlier. What all of them do is not in the result, so it is
/// looked at besides, not instead.
/// returns: parallel to `series`, control series as they are; nothing where no backend's noise becomes less by it
[[nodiscard]] std::optional<std::vector<CheckedSeries>> without_night_effects(std::span<const CheckedSeries> series);

}  // namespace reliefbench
