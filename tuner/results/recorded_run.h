#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tuner/plan/config.h"
#include "tuner/results/case_table.h"
#include "tuner/search/recorded_table.h"

namespace reliefbench {

/// What of a recorded sweep is wanted.
struct RecordedQuery {
  std::string backend{};                             ///< "" = the only one there is
  std::string scene{};                               ///< "" = the only one there is
  std::optional<std::string> error_metric{};         ///< none: the run's own; of a table the config's default
  std::optional<std::vector<Budget>> constraints{};  ///< likewise
  std::optional<std::vector<Budget>> budgets{};      ///< of the answer; likewise
};

/// The measured cases of one backend and scene as a search space (empty_setting_space()) with recorded
/// times; a candidate's id is its case's. Cases that are not ok, or have no value of the metric, are left out.
/// query: its error_metric and constraints must be set; file: for messages only
/// throws: Error(bad_input): no such backend or scene, several to choose from, a metric where higher is better,
///         nothing was measured, a case without samples
[[nodiscard]] RecordedTable recorded_table(std::span<const TableRow> rows, const RecordedQuery& query,
                                           std::string_view file);

/// Reads a run folder, or a table.csv that stands alone.
/// throws: Error(bad_input): neither of them; as recorded_table()
[[nodiscard]] RecordedTable load_recorded(const std::filesystem::path& path, const RecordedQuery& query);

}  // namespace reliefbench
