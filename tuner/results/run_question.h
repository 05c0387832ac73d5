#pragma once
#include <string>
#include <vector>

#include "tuner/plan/config.h"
#include "tuner/results/store.h"

namespace reliefbench {

/// What a run was made to answer.
struct RunQuestion {
  std::string error_metric;         ///< of its front
  std::vector<Budget> constraints;  ///< on its front
  std::vector<Budget> budgets;      ///< a tune's --max-error, else the config's
};
/// Where the run does not say: a config's defaults.
/// info: run.json; null of a table, which says nothing
/// throws: Error(bad_input): a budget that is none
[[nodiscard]] RunQuestion question_of(const nlohmann::json& info);
[[nodiscard]] RunQuestion question_of(const Run& run);

/// Whether `tune` made the folder: it then holds the settings that it answers with, not the space.
[[nodiscard]] bool is_of_tune(const Run& run);

}  // namespace reliefbench
