#pragma once
#include <span>

#include "tuner/decide/track.h"

namespace reliefbench {

/// A series is gone where its machine had several nights since its last value, and more than it was ever left out for
/// before: a machine may measure some of its cases in every other run only.
/// epochs: of a series, the one that it was in last comes last
[[nodiscard]] Coverage coverage_of(const HistoryView& view, std::span<const EpochChanges> epochs,
                                   const EventOptions& options);

}  // namespace reliefbench
