#include "tuner/results/recorded_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>
#include <tuple>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/budgets.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

using Group = std::tuple<std::string, std::string, std::string>;  ///< backend, scene, device
Group group_of(const TableRow& row) { return {row.backend, row.scene, row.device}; }

std::string text_of(const Group& group) {
  const auto& [backend, scene, device] = group;
  return fmt::format("{} {} ({})", backend, scene, device);
}

/// The one group that the query means.
Group choose(std::span<const TableRow> rows, const RecordedQuery& query, std::string_view file) {
  std::set<Group> all;
  for (const TableRow& row : rows) all.insert(group_of(row));
  std::vector<std::string> known;
  std::vector<Group> meant;
  for (const Group& group : all) {
    const auto& [backend, scene, device] = group;
    known.push_back(text_of(group));
    if ((query.backend.empty() || query.backend == backend) && (query.scene.empty() || query.scene == scene))
      meant.push_back(group);
  }
  if (known.empty()) throw Error(Exit::nothing_measured, fmt::format("{}: holds no case", file));
  if (meant.empty())
    fail_input("{}: has nothing of backend '{}' and scene '{}' (it has {})", file,
               query.backend.empty() ? "*" : query.backend, query.scene.empty() ? "*" : query.scene,
               fmt::join(known, ", "));
  if (meant.size() == 1) return meant.front();
  known.clear();
  for (const Group& group : meant) known.push_back(text_of(group));
  fail_input("{}: holds {} sweeps, choose one by --backend and --scene: {}", file, meant.size(),
             fmt::join(known, ", "));
}

/// The metric's place in TableRow::errors.
std::size_t metric_index(std::string_view id) { return static_cast<std::size_t>(&find_metric(id) - metrics().data()); }

}  // namespace

RecordedTable recorded_table(std::span<const TableRow> rows, const RecordedQuery& query, std::string_view file) {
  const std::size_t error = metric_index(query.error_metric.value());
  if (!metrics()[error].lower_is_better) fail_input("'{}' is no error: higher is better", *query.error_metric);
  const Group group = choose(rows, query, file);
  RecordedTable table{.space = empty_setting_space(),
                      .backend = std::get<0>(group),
                      .device = std::get<2>(group),
                      .scene = std::get<1>(group),
                      .error_metric = *query.error_metric,
                      .constraints = {},
                      .samples = {}};
  const std::vector<Budget>& constraints = query.constraints.value();
  table.constraints = budget_texts(constraints);
  if (query.budgets) table.asked_error = limit_on(table.error_metric, *query.budgets);
  const std::vector<const MetricRow*> work = work_metrics();
  double least = std::numeric_limits<double>::infinity();
  for (const TableRow& row : rows) {
    if (group_of(row) != group || row.status != Status::ok || !row.errors[error]) continue;
    if (row.samples_ns.empty()) fail_input("{}: case '{}' has no samples", file, row.case_id);
    Candidate candidate = candidate_of(row.settings, row.case_id);
    candidate.error = *row.errors[error];
    for (std::size_t i = 0; i < work.size(); ++i) candidate.work[i] = row.errors[metric_index(work[i]->id)].value_or(0);
    const Miss miss =
        miss_of(constraints, [&](const Budget& budget) { return row.errors[metric_index(budget.metric)]; });
    candidate.is_feasible = miss.text.empty();
    if (miss.worst < least) {
      least = miss.worst;
      table.nearest = row.case_id;
      table.miss = miss.text;
    }
    table.scene_key = row.scene_key.hex;  // of a table's scene there is one
    table.space.candidates.push_back(std::move(candidate));
    table.samples.push_back(row.samples_ns);
    table.memory_bytes.push_back(row.memory_bytes);
  }
  if (table.samples.empty())
    throw Error(Exit::nothing_measured, fmt::format("{}: no case of {} was measured with a value of {}", file,
                                                    text_of(group), table.error_metric));
  if (table.miss.empty()) table.nearest.clear();
  drop_unused_axes(table.space);
  table.space.check();
  return table;
}

RecordedTable load_recorded(const std::filesystem::path& path, const RecordedQuery& query) {
  RecordedQuery full = query;
  std::vector<TableRow> rows;
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) {
    rows = parse_case_table(read_file(path), path.string());
  } else {
    const Run run = load_run(path);
    const RunQuestion question = question_of(run);
    if (!full.error_metric) full.error_metric = question.error_metric;
    if (!full.constraints) full.constraints = question.constraints;
    if (!full.budgets) full.budgets = question.budgets;
    rows = case_table(run);
  }
  const Config defaults;
  if (!full.error_metric) full.error_metric = defaults.front_error;
  if (!full.constraints) full.constraints = defaults.front_constraints;
  if (!full.budgets) full.budgets = defaults.budgets;
  return recorded_table(rows, full, path.string());
}

}  // namespace reliefbench
