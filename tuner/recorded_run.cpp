#include "tuner/recorded_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "kernels/error.h"
#include "tuner/append_file.h"
#include "tuner/pareto.h"
#include "tuner/registry_params.h"
#include "tuner/run_files.h"

namespace reliefbench {
namespace {

/// The parameters with named values, or those without.
std::vector<const RegistryParam*> params_where(bool named) {
  std::vector<const RegistryParam*> params;
  for (const RegistryParam& param : registry_params())
    if (param.values.empty() != named) params.push_back(&param);
  return params;
}

/// Names of the axes: what stands first, then the parameters.
std::vector<std::string> axes_of(std::vector<std::string> names, bool named) {
  for (const RegistryParam* param : params_where(named)) names.emplace_back(param->id);
  return names;
}

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
  if (known.empty()) fail_input("{}: holds no case", file);
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

Candidate candidate_of(const Settings& settings) {
  const auto active = [&](std::string_view id) {
    const Param* const param = settings.technique().find(id);
    return param != nullptr && settings.is_active(*param);
  };
  const auto technique = static_cast<int>(&settings.technique() - techniques().data());
  Candidate candidate{.id = {}, .categories = {technique}, .steps = {}};
  for (const RegistryParam* param : params_where(true))
    candidate.categories.push_back(active(param->id) ? param->index(settings.choice(param->id)) : -1);
  for (const RegistryParam* param : params_where(false))
    candidate.steps.push_back(active(param->id) ? settings.get(param->id) : 0);
  return candidate;
}

RecordedTable recorded_table(std::span<const TableRow> rows, const RecordedQuery& query, std::string_view file) {
  const std::size_t error = metric_index(query.error_metric.value());
  if (!metrics()[error].lower_is_better) fail_input("'{}' is no error: higher is better", *query.error_metric);
  const Group group = choose(rows, query, file);
  RecordedTable table{
      .space = {.category_axes = axes_of({"technique"}, true), .step_axes = axes_of({}, false), .candidates = {}},
      .backend = std::get<0>(group),
      .device = std::get<2>(group),
      .scene = std::get<1>(group),
      .error_metric = *query.error_metric,
      .constraints = {},
      .samples = {}};
  const std::vector<Budget>& constraints = query.constraints.value();
  for (const Budget& budget : constraints) table.constraints.push_back(budget.text());
  for (const TableRow& row : rows) {
    if (group_of(row) != group || row.status != Status::ok || !row.errors[error]) continue;
    if (row.samples_ns.empty()) fail_input("{}: case '{}' has no samples", file, row.case_id);
    Candidate candidate = candidate_of(row.settings);
    candidate.id = row.case_id;
    candidate.error = *row.errors[error];
    candidate.is_feasible = std::ranges::all_of(
        constraints, [&](const Budget& budget) { return within(row.errors[metric_index(budget.metric)], budget); });
    table.space.candidates.push_back(std::move(candidate));
    table.samples.push_back(row.samples_ns);
  }
  if (table.samples.empty())
    fail_input("{}: no case of {} was measured with a value of {}", file, text_of(group), table.error_metric);
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
    const nlohmann::json front = run.info.value("front", nlohmann::json::object());
    if (!full.error_metric && front.contains("error")) full.error_metric = front.at("error").get<std::string>();
    if (!full.constraints && front.contains("constraints"))
      full.constraints = parse_budgets(front.at("constraints").get<std::vector<std::string>>());
    rows = case_table(run);
  }
  const Config defaults;
  if (!full.error_metric) full.error_metric = defaults.front_error;
  if (!full.constraints) full.constraints = defaults.front_constraints;
  return recorded_table(rows, full, path.string());
}

}  // namespace reliefbench
