#include <algorithm>
#include <array>

#include "tuner/decide/compare.h"

namespace reliefbench {
namespace {

struct ReasonRow {
  Reason reason;
  std::string_view id;
  std::string_view text;
};
constexpr std::array kReasons = {
    ReasonRow{Reason::interval_within_threshold, "interval_within_threshold",
              "the whole interval lies within the threshold"},
    ReasonRow{Reason::same_measurement, "same_measurement", "both runs hold the very same samples"},
    ReasonRow{Reason::beyond_chance, "beyond_chance", "chance is no explanation"},
    ReasonRow{Reason::control_drift, "control_drift", "the control case moved, too: the device was in another state"},
    ReasonRow{Reason::different_driver, "different_driver",
              "the drivers differ, too: nothing here tells a driver's change from a build's"},
    ReasonRow{Reason::too_few_samples, "too_few_samples", "the samples are too few or too noisy for any answer"},
    ReasonRow{Reason::shift_between_runs, "shift_between_runs",
              "cases shift from run to run: more runs would tell, more samples would not"},
    ReasonRow{Reason::interval_spans_threshold, "interval_spans_threshold", "the ratio is near the threshold"},
    ReasonRow{Reason::chance_not_excluded, "chance_not_excluded", "one of so many ratios is that large by chance"},
    ReasonRow{Reason::remeasured, "remeasured", "measured again, in turns"},
    ReasonRow{Reason::remeasured_too_little, "remeasured_too_little",
              "measured again, in turns, but too seldom: more --rounds would tell"},
};

const ReasonRow& row_of(Reason reason) { return *std::ranges::find(kReasons, reason, &ReasonRow::reason); }

}  // namespace

std::string_view error_change_id(const ErrorChange& change) {
  if (change.counts_work) return change.now > change.base ? "more" : "fewer";
  return change.worse ? "worse" : "better";
}

std::string_view change_id(Change change) {
  switch (change) {
    case Change::faster:
      return "faster";
    case Change::slower:
      return "slower";
    case Change::same:
      return "same";
    case Change::unclear:
      return "unclear";
  }
  return "unclear";
}

std::string_view reason_id(Reason reason) { return row_of(reason).id; }

std::string_view reason_text(Reason reason) { return row_of(reason).text; }

}  // namespace reliefbench
