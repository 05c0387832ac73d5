#pragma once
#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tuner/decide/fleet_run.h"

namespace reliefbench {

/// A setting's time in a place.
struct SettingTime {
  double log_time = 0;  ///< of ns; mean over the runs
  double variance = 0;  ///< of log_time; without what all settings of a run share
  double df = 0;        ///< of the variance, at most kMostDf
  /// Of each run: what each sample, by time, contributes to log_time's error. What was drawn together has one index.
  std::vector<std::vector<double>> errors;
  std::vector<const TableRow*> rows;  ///< one a run
};

/// What the runs of a place say of its settings' times.
///
/// A setting's log time in a run is a Huber location of its samples, its variance moderated by those of the place's
/// other settings. Where a place has several runs, two things more are estimated: what shifts a case by itself from one
/// run to the next, from how far the differences of runs scatter beyond what sampling explains (robustly), and what
/// shifts all cases of a run together, from all runs that share settings; runs that share none, nor through others, are
/// taken as they are. The first is in each setting's variance. Of one run neither is known.
struct PlaceTimes {
  std::map<std::string, SettingTime> settings;  ///< by setting_id()
  std::optional<double> between_runs;           ///< deviation, of a log, of what shifts one case; none: not known
  std::optional<double> shared_variance;        ///< of the mean over the runs of what shifts all cases; none: not known
  double shared_df = 0;                         ///< of the variance
};
/// counts: which rows have a say; they must be ok
/// throws: Error(bad_input): a row of fewer than two samples, of the run that is named
[[nodiscard]] PlaceTimes place_times(const MeasuredPlace& place, std::span<const FleetRun> runs,
                                     const std::function<bool(const TableRow&)>& counts);

}  // namespace reliefbench
