#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/base/error.h"
#include "tuner/results/statistics.h"
#include "tuner/results/store.h"

namespace reliefbench {

/// same: the whole interval of the ratio lies within the threshold.
/// faster, slower: the ratio lies beyond the threshold and the difference is significant.
/// unclear: neither can be said.
enum class Change { faster, slower, same, unclear };
[[nodiscard]] std::string_view change_id(Change change);

struct CaseChange {
  std::string case_id;
  RatioInterval ratio;  ///< new / base of frame time
  double p = 1;         ///< Mann-Whitney, Holm-corrected over all matched cases
  Change change = Change::unclear;
};

/// An error metric that differs: errors are deterministic, so any difference is a change of picture.
struct ErrorChange {
  std::string case_id;
  std::string metric;
  std::optional<double> base;  ///< none: psnr of identical pictures
  std::optional<double> now;
  bool worse = false;  ///< by the metric's direction
};

struct Comparison {
  std::string metric;             ///< as asked
  std::size_t matched = 0;        ///< cases ok in both runs
  std::vector<CaseChange> cases;  ///< the matched ones, worst ratio first; empty for an error metric
  std::vector<ErrorChange> errors;
  std::vector<std::string> lost;       ///< "case id: status reason": ok in base, tried again and not ok
  std::vector<std::string> only_base;  ///< case ids
  std::vector<std::string> only_new;
  double geometric_mean = 1;                                  ///< of the ratios
  std::vector<std::pair<std::string, double>> control_ratio;  ///< backend -> new / base of the control case, raw
  std::vector<std::string> warnings;
  bool has_power = true;  ///< false: too few samples for any difference to be significant among so many cases
};

struct CompareOptions {
  /// frame_time: each sample relative to the control samples near it, since drift cancels; frame_time_raw; or an error
  /// metric's id: then only differences of that metric are looked for.
  std::string metric = "frame_time";
  double threshold = 0.05;   ///< a change smaller than this is `same`; limits are 1 + threshold and its inverse
  double confidence = 0.95;  ///< of each interval, and family-wise of all faster and slower
};

/// Matches the cases of two runs of one device by setting and scene key (match_key), so that one name for two scenes
/// matches nothing. Another host is only a warning.
/// throws: Error(bad_input): the runs are of different devices or drivers (named), unknown metric
[[nodiscard]] Comparison compare_runs(const Run& base, const Run& now, const CompareOptions& options);

/// 5: nothing matched; 1: a slower case, a worse error or a lost case; 4: unclear cases, and too few samples to tell; 0
[[nodiscard]] Exit exit_of(const Comparison& comparison);

[[nodiscard]] nlohmann::json comparison_json(const Comparison& comparison);

}  // namespace reliefbench
