#include "tuner/decide/compare.h"

namespace reliefbench {

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

std::string_view reason_id(Reason reason) {
  switch (reason) {
    case Reason::interval_within_threshold:
      return "interval_within_threshold";
    case Reason::same_measurement:
      return "same_measurement";
    case Reason::beyond_chance:
      return "beyond_chance";
    case Reason::control_drift:
      return "control_drift";
    case Reason::different_driver:
      return "different_driver";
    case Reason::too_few_samples:
      return "too_few_samples";
    case Reason::shift_between_runs:
      return "shift_between_runs";
    case Reason::interval_spans_threshold:
      return "interval_spans_threshold";
    case Reason::chance_not_excluded:
      return "chance_not_excluded";
    case Reason::remeasured:
      return "remeasured";
    case Reason::remeasured_too_little:
      return "remeasured_too_little";
  }
  return "too_few_samples";
}

std::string_view reason_text(Reason reason) {
  switch (reason) {
    case Reason::interval_within_threshold:
      return "the whole interval lies within the threshold";
    case Reason::same_measurement:
      return "both runs hold the very same samples";
    case Reason::beyond_chance:
      return "chance is no explanation";
    case Reason::control_drift:
      return "the control case moved, too: the device was in another state";
    case Reason::different_driver:
      return "the drivers differ, too: nothing here tells a driver's change from a build's";
    case Reason::too_few_samples:
      return "the samples are too few or too noisy for any answer";
    case Reason::shift_between_runs:
      return "cases shift from run to run: more runs would tell, more samples would not";
    case Reason::interval_spans_threshold:
      return "the ratio is near the threshold";
    case Reason::chance_not_excluded:
      return "one of so many ratios is that large by chance";
    case Reason::remeasured:
      return "measured again, in turns";
    case Reason::remeasured_too_little:
      return "measured again, in turns, but too seldom: more --rounds would tell";
  }
  return "";
}

}  // namespace reliefbench
