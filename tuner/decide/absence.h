#pragma once
#include <cstddef>
#include <cstdint>
#include <map>

#include "tuner/decide/events.h"
#include "tuner/decide/run_calendar.h"
#include "tuner/history/rows.h"

namespace reliefbench {

/// Tells of events that a look at a history does not show whether they are gone, or whether the look could not have
/// shown them: it may be at fewer nights than those before it, or for larger steps.
class Absence {
 public:
  /// Both outlive it.
  Absence(const HistoryView& view, const EventOptions& options);

  /// A step is gone where it is large enough to be looked for, and each of its series has nights enough before and
  /// after it; where earlier nights are left out, less of it than half must be left, besides: few nights hide a step.
  /// A drift, or other errors: where all its nights are looked at. Cases that were lost: where all are ok again.
  [[nodiscard]] bool is_gone(const EventRow& event) const;

 private:
  [[nodiscard]] bool is_taken_back(const EventRow& event) const;
  [[nodiscard]] bool are_ok_again(const EventRow& event) const;

  const HistoryView& view_;
  const EventOptions& options_;
  RunCalendar calendar_;
  std::map<std::int64_t, std::size_t> series_;  ///< by id
};

}  // namespace reliefbench
