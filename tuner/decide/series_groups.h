#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "tuner/decide/events.h"

namespace reliefbench {

/// Series of one machine that have traits in common.
struct SeriesGroup {
  std::string what;                  ///< "everything", "vulkan", "format=r16", "vulkan technique=cone format=r16"
  std::vector<std::size_t> members;  ///< indices, at least two
};
/// All groups by a backend, one or two other traits, or both; without the control series. Of groups with the same
/// members the one with the fewest traits stands. Groups of fewer traits first.
[[nodiscard]] std::vector<SeriesGroup> series_groups(std::span<const CheckedSeries> series);

/// Log values by night of a common calendar, which rises.
struct Track {
  std::vector<std::size_t> calendar;
  std::vector<double> logs;
  std::vector<double> errors;  ///< standard errors
};
struct WeightedTrack {
  const Track* track = nullptr;
  double weight = 1;
};
/// What tracks have in common: the nights' part of an additive fit of track and night (backfitting), so that a track
/// which starts late or misses nights makes no step. A night counts where a third of the tracks have it.
[[nodiscard]] Track pooled(std::span<const WeightedTrack> tracks);

}  // namespace reliefbench
