#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "tuner/statistics.h"
#include "tuner/store.h"

namespace reliefbench {

enum class Change { faster, slower, same, unclear };
[[nodiscard]] std::string_view change_id(Change change);

struct CaseChange {
  std::string case_id;
  RatioInterval ratio;  ///< new / base of control-relative frame time
  double p = 1;         ///< Mann-Whitney, Holm-corrected
  Change change = Change::unclear;
};

/// An error metric that differs: errors are deterministic, so any difference is a change of picture.
struct ErrorChange {
  std::string case_id;
  std::string metric;
  double base = 0;
  double now = 0;
};

struct Comparison {
  std::vector<CaseChange> cases;  ///< matched by case id, ok in both
  std::vector<ErrorChange> errors;
  std::vector<std::string> only_base;  ///< case ids
  std::vector<std::string> only_new;
  double geometric_mean = 1;                                  ///< of the ratios
  std::vector<std::pair<std::string, double>> control_ratio;  ///< backend -> new / base of the control case, raw
};

struct CompareOptions {
  double threshold = 0.05;   ///< a change smaller than this is `same`
  double confidence = 0.95;  ///< family-wise
};

/// throws: Error(bad_input): the runs are of different devices (named)
[[nodiscard]] Comparison compare_runs(const Run& base, const Run& now, const CompareOptions& options);

}  // namespace reliefbench
