#include "tuner/results/budgets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace reliefbench {

std::optional<double> metric_value(const Record& record, std::string_view metric_id) {
  const MetricRow& metric = find_metric(metric_id);
  if (record.status != Status::ok || !record.error) return std::nullopt;
  return metric.value(*record.error);
}

bool meets(const Record& record, const Budget& budget) {
  return record.status == Status::ok && record.error && meets(*record.error, budget);
}

bool meets(const FrameScore& score, const Budget& budget) {
  return within(find_metric(budget.metric).value(score), budget);
}

bool within(std::optional<double> value, const Budget& budget) {
  const MetricRow& metric = find_metric(budget.metric);
  if (!value) return metric.none_is_best();
  return metric.lower_is_better ? *value <= budget.limit : *value >= budget.limit;
}

std::optional<double> limit_on(std::string_view metric_id, std::span<const Budget> budgets) {
  const auto found = std::ranges::find(budgets, metric_id, &Budget::metric);
  return found == budgets.end() ? std::nullopt : std::optional(found->limit);
}

std::vector<Budget> budgets_beside(std::string_view metric_id, std::span<const Budget> budgets) {
  std::vector<Budget> beside(budgets.begin(), budgets.end());
  std::erase_if(beside, [&](const Budget& budget) { return budget.metric == metric_id; });
  return beside;
}

double relative_miss(double excess, double limit) { return excess / (limit == 0 ? 1 : std::abs(limit)); }

Miss miss_of(std::span<const Budget> budgets, const std::function<std::optional<double>(const Budget&)>& value) {
  Miss miss;
  for (const Budget& budget : budgets) {
    const std::optional<double> is = value(budget);
    if (within(is, budget)) continue;
    const double excess = std::abs(is.value_or(std::numeric_limits<double>::infinity()) - budget.limit);
    miss.worst = std::max(miss.worst, relative_miss(excess, budget.limit));
    miss.text += fmt::format("{}{} is {} where {:.4g} is asked", miss.text.empty() ? "" : ", ", budget.metric,
                             is ? fmt::format("{:.4g}", *is) : "undefined", budget.limit);
  }
  return miss;
}

Miss miss_of(std::span<const Budget> budgets, const FrameScore& score) {
  return miss_of(budgets, [&](const Budget& budget) { return find_metric(budget.metric).value(score); });
}

}  // namespace reliefbench
