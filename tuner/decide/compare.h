#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/base/error.h"
#include "tuner/results/store.h"

namespace reliefbench {

/// same: the whole interval of the ratio lies within the threshold.
/// faster, slower: it does not, and the ratio is not 1 beyond doubt (the corrected p).
/// unclear: neither can be said.
enum class Change { faster, slower, same, unclear };
[[nodiscard]] std::string_view change_id(Change change);

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
};

struct CaseChange : TimeChange {
  std::string case_id;
};

/// The geometric mean of several cases' ratios.
struct GroupChange : TimeChange {
  std::string group;  ///< "all", "vulkan", "vulkan technique=cone", "vulkan map=relaxed", "vulkan format=rg8"
  std::size_t cases = 0;
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
  std::vector<std::string> warnings;
};

struct CompareOptions {
  /// frame_time: each sample relative to the control samples near it, since drift cancels; frame_time_raw; or another
  /// metric's id: then only differences of that metric are looked for.
  std::string metric = "frame_time";
  double threshold = 0.05;   ///< a change smaller than this is `same`; limits are 1 + threshold and its inverse
  double confidence = 0.95;  ///< of each interval, and family-wise of all faster and slower
};

/// Matches the cases of two runs of one device by setting and scene key (match_key), so that one name for two scenes
/// matches nothing. Another host is only a warning.
/// throws: Error(bad_input): the runs are of different devices or drivers (named), unknown metric, a case without
///         samples
[[nodiscard]] Comparison compare_runs(const Run& base, const Run& now, const CompareOptions& options);

/// A case that is ok in both runs.
struct CaseMatch {
  const Record* base;
  const Record* now;
};
/// Fills in what a comparison says of times.
void compare_times(const Run& base, const Run& now, std::span<const CaseMatch> matches, const CompareOptions& options,
                   Comparison& comparison);

/// Whether the evidence is too little to call times unchanged: a group is unclear, or more than half of the cases are.
[[nodiscard]] bool is_inconclusive(const Comparison& comparison);

/// 5: nothing matched; 1: a slower case or group, a worse error or a lost case; 4: is_inconclusive(); 0
[[nodiscard]] Exit exit_of(const Comparison& comparison);

[[nodiscard]] nlohmann::json comparison_json(const Comparison& comparison);

}  // namespace reliefbench
