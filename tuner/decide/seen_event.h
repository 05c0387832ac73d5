#pragma once
#include <cstddef>
#include <span>
#include <string>

#include "tuner/history/rows.h"

namespace reliefbench {

/// What one look at a history shows, without what earlier ones said of it. The row has no states yet.
struct SeenEvent {
  EventRow row;
  EventState state = EventState::suspect;
  std::string reason{};
};

/// An event of a machine's nights, nothing else of it set.
[[nodiscard]] EventRow event_between(const std::string& machine, std::int64_t good_run, std::int64_t bad_run);

/// A series' name, and what its case has others of: metrics, devices.
[[nodiscard]] std::string name_among(const HistoryView& view, std::size_t series);

/// What an event's series have in common, for people.
[[nodiscard]] std::string common_name(const HistoryView& view, std::span<const std::size_t> series);

}  // namespace reliefbench
