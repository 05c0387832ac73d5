#pragma once
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "tuner/history/rows.h"

namespace reliefbench {

/// A build measured once more. log_values: of an event's series, by setting and metric (rerun_key())
struct Rerun {
  bool is_bad = false;  ///< of the suspect build, not of the good one
  std::map<std::string, double> log_values;
};
[[nodiscard]] std::string rerun_key(const SeriesRow& series);

/// The least rounds of good, bad, bad, good that say how sure the answer is.
inline constexpr int kLeastRounds = 2;

/// What the re-runs of both builds say.
struct RerunAnswer {
  double log_ratio = 0;  ///< bad / good, of the mean over the series
  double low = 0;        ///< its interval, at 95 %
  double high = 0;
  std::size_t series = 0;           ///< that were measured in every re-run
  std::optional<EventState> state;  ///< confirmed, cleared; none: the interval is too wide to say
};

/// A step between two builds, from re-runs of both.
struct RerunStep {
  double log_ratio = 0;  ///< bad / good, of the mean over the series
  double low = 0;
  double high = 0;
};
/// The mean log value of a run, as a step between the builds on a line through time: runs in the order good, bad, bad,
/// good have no part of a steady drift in their step. Student's t with n - 3 degrees of freedom.
/// reruns: by time, kLeastRounds rounds of good, bad, bad, good at least; keys: of series that all of them have
[[nodiscard]] RerunStep rerun_step(std::span<const Rerun> reruns, const std::set<std::string>& keys, double confidence);

/// rerun_step() over all series that every re-run has, at 95 %.
/// cleared: the interval excludes half of what the history showed; so does one beside 1, since two builds always differ
/// by a little. confirmed: else, where it lies beyond 1 on the event's side.
/// reruns: by time, kLeastRounds rounds of good, bad, bad, good at least; log_ratio: of the event
/// throws: Error(bad_input): no series was measured in all of them
[[nodiscard]] RerunAnswer judge_reruns(std::span<const Rerun> reruns, double log_ratio);

}  // namespace reliefbench
