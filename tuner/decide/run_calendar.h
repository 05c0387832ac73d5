#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>

#include "tuner/history/rows.h"

namespace reliefbench {

/// Runs by their place in time; -1 is before the nights looked at.
class RunCalendar {
 public:
  /// runs: by time
  explicit RunCalendar(std::span<const RunRow> runs) {
    for (std::size_t i = 0; i < runs.size(); ++i) places_[runs[i].id] = static_cast<std::ptrdiff_t>(i);
  }
  [[nodiscard]] bool has(std::int64_t run) const { return places_.contains(run); }
  [[nodiscard]] std::ptrdiff_t of(std::int64_t run) const { return has(run) ? places_.at(run) : -1; }

 private:
  std::map<std::int64_t, std::ptrdiff_t> places_;
};

}  // namespace reliefbench
