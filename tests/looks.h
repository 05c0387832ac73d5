#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "tuner/decide/track.h"

// Looks at a history in memory, one after the other.
namespace reliefbench {

inline constexpr std::int64_t kNow = 1'770'000'000;

inline TrackCheck checked(const HistoryView& view) { return check_history(view, {}, kNow); }

/// What the store would do: the events with their ids.
inline void keep(HistoryView& view, const TrackCheck& check) {
  view.events = check.events;
  std::int64_t last = 0;
  for (const EventRow& event : view.events) last = std::max(last, event.id);
  for (EventRow& event : view.events)
    if (event.id == 0) event.id = ++last;
}

/// The first nights of a history: what an earlier check saw.
inline HistoryView first_nights(const HistoryView& view, std::size_t count) {
  HistoryView early = view;
  early.runs.resize(count);
  for (auto& nights : early.nights) nights.resize(std::min(nights.size(), count));
  return early;
}

/// What `--since` leaves of a history.
inline HistoryView without_first_nights(const HistoryView& view, std::size_t count) {
  HistoryView late = view;
  const auto many = static_cast<std::ptrdiff_t>(count);
  late.is_whole = false;
  late.runs.erase(late.runs.begin(), late.runs.begin() + many);
  for (auto& nights : late.nights) nights.erase(nights.begin(), nights.begin() + many);
  return late;
}

inline EventState state_of(const EventRow& event) { return event.states.back().state; }

}  // namespace reliefbench
