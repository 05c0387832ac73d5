#pragma once
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/base/error.h"
#include "tuner/results/environment.h"
#include "tuner/results/store.h"

namespace reliefbench {

/// same: the whole interval of the ratio lies within the threshold.
/// faster, slower: it does not, and the ratio is not 1 beyond doubt (the corrected p).
/// unclear: neither can be said.
enum class Change { faster, slower, same, unclear };
[[nodiscard]] std::string_view change_id(Change change);

/// Why a verdict is what it is.
enum class Reason {
  interval_within_threshold,  ///< same
  same_measurement,           ///< same: both runs hold the very same samples
  beyond_chance,              ///< faster, slower: chance is no explanation for all that was looked at
  control_drift,              ///< ... but the control case moved beyond the threshold; unclear where it moved as far
  different_driver,           ///< ... but the drivers differ, too
  too_few_samples,            ///< unclear: the interval is so wide that it would span the threshold round a ratio of 1
  shift_between_runs,  ///< ... for the most part as cases shift from run to run: more runs would narrow it, not samples
  interval_spans_threshold,  ///< unclear: narrow enough, but the ratio is near the threshold
  chance_not_excluded,       ///< unclear: the interval excludes 1, but one of so many does so by chance
  remeasured,                ///< same, faster, slower: by a re-run in turns
  remeasured_too_little,     ///< unclear after a re-run: more rounds would say more
};
[[nodiscard]] std::string_view reason_id(Reason reason);    ///< stable: for programs
[[nodiscard]] std::string_view reason_text(Reason reason);  ///< for people

/// Ratio new / base of frame time. The interval is infinite where too few samples say nothing of it.
struct RatioInterval {
  double ratio = 1;
  double low = 1;
  double high = 1;
};

/// What is known of a ratio.
struct TimeChange {
  RatioInterval ratio;
  double p = 1;  ///< Student's t, corrected: family-wise over the whole, the groups and the cases together
  Change change = Change::unclear;
  Reason reason = Reason::too_few_samples;
  std::string backend{};    ///< "" of the whole of several
  double shift_margin = 0;  ///< of the log ratio's half interval: what would be left with endless samples
};

/// Puts what was measured again in the place of a verdict. log_ratio, low, high: of the re-run, new / base
void set_remeasured(TimeChange& change, double log_ratio, double low, double high, double threshold);

/// Whether a further measurement would say more of it: it is unclear, or rests on what may not hold.
[[nodiscard]] bool is_doubtful(const TimeChange& change);

struct CaseChange : TimeChange {
  std::string case_id;
};

/// The geometric mean of several cases' ratios.
struct GroupChange : TimeChange {
  std::string group;  ///< "all", "vulkan", "vulkan technique=cone", "vulkan map=relaxed", "vulkan format=rg8"
  std::size_t cases = 0;
  std::vector<std::string> case_ids{};  ///< of base
};

/// A metric that differs. Scores are deterministic, so any difference is a change of what is drawn.
struct ErrorChange {
  std::string case_id;
  std::string metric;
  std::optional<double> base;  ///< none: psnr of identical pictures
  std::optional<double> now;
  bool worse = false;  ///< by the metric's direction; never for what counts work: taps cost time, which is measured
  bool counts_work = false;
};
[[nodiscard]] std::string_view error_change_id(const ErrorChange& change);  ///< worse, better; more or fewer of work

struct Comparison {
  std::string metric;               ///< as asked
  std::size_t matched = 0;          ///< cases ok in both runs
  std::vector<CaseChange> cases;    ///< the matched ones, worst ratio first; empty for an error metric
  std::vector<GroupChange> groups;  ///< "all" first; empty for an error metric
  std::vector<ErrorChange> errors;
  std::vector<std::string> lost;       ///< "case id: status reason": ok in base, tried again and not ok
  std::vector<std::string> only_base;  ///< case ids
  std::vector<std::string> only_new;
  std::vector<std::pair<std::string, double>> control_ratio;  ///< backend -> new / base of the control case, raw
  std::vector<std::pair<std::string, double>> between_runs;   ///< backend -> LogRatios::between_runs()
  std::vector<std::string> assumed;                           ///< what the times' verdicts rest on
  std::vector<EnvironmentDifference> environment;             ///< base and new
  std::vector<std::string> drivers;  ///< "vulkan: Mesa 22.3.6, now Mesa 24.0" where they differ
  bool is_unfinished = false;        ///< the new run is, and lacks cases of the base: they may still come
  std::vector<std::string> warnings;
};

struct CompareOptions {
  /// frame_time: each sample relative to the control samples near it, since drift cancels; frame_time_raw; or another
  /// metric's id: then only differences of that metric are looked for.
  std::string metric = "frame_time";
  double threshold = 0.05;      ///< a change smaller than this is `same`; limits are 1 + threshold and its inverse
  double confidence = 0.95;     ///< of each interval, and family-wise of all faster and slower
  bool across_drivers = false;  ///< another driver is named, not refused
};

/// Matches the cases of two runs of one device by setting and scene key (match_key), so that one name for two scenes
/// matches nothing. Another host is only a warning.
/// throws: Error(bad_input): the runs are of different devices, or of different drivers without across_drivers (named),
///         unknown metric, a case without samples
[[nodiscard]] Comparison compare_runs(const Run& base, const Run& now, const CompareOptions& options);

/// A device as a run names it.
struct NamedDevice {
  std::string name;
  std::string driver;
  friend bool operator==(const NamedDevice&, const NamedDevice&) = default;
};
/// By backend. throws: Error(bad_input): run.json does not say it
[[nodiscard]] std::map<std::string, NamedDevice> named_devices(const Run& run);

/// A case that is ok in both runs.
struct CaseMatch {
  const Record* base;
  const Record* now;
};
/// Fills in what a comparison says of times.
void compare_times(const Run& base, const Run& now, std::span<const CaseMatch> matches, const CompareOptions& options,
                   Comparison& comparison);

/// Whether the evidence is too little to call times unchanged: a group is unclear, or more than half of the cases are,
/// or the new run is unfinished and lacks cases.
[[nodiscard]] bool is_inconclusive(const Comparison& comparison);

/// Id of the whole's verdict: slower, worse_errors, lost, nothing_matched, inconclusive, faster or same.
[[nodiscard]] std::string_view verdict_id(const Comparison& comparison);

/// 5: nothing matched; 1: a slower case or group, a worse error or a lost case; 4: inconclusive; 0
[[nodiscard]] Exit exit_of(const Comparison& comparison);

[[nodiscard]] nlohmann::json comparison_json(const Comparison& comparison);

}  // namespace reliefbench
