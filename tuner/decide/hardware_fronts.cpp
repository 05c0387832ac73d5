#include "tuner/decide/hardware_fronts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tuner/decide/pareto.h"
#include "tuner/results/budgets.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

/// A setting that all columns measured.
struct CommonSetting {
  std::vector<const SettingTime*> times;  ///< parallel to the columns
};

std::vector<CommonSetting> common_settings_of(std::span<const FrontColumn> columns, std::size_t metric) {
  std::vector<CommonSetting> settings;
  for (const auto& entry : columns.front().times->settings) {
    CommonSetting one;
    for (const FrontColumn& column : columns) {
      const auto found = column.times->settings.find(entry.first);
      if (found == column.times->settings.end() || !found->second.rows.front()->errors[metric]) break;
      one.times.push_back(&found->second);
    }
    if (one.times.size() == columns.size()) settings.push_back(std::move(one));
  }
  return settings;
}

/// The front of one column, as FrontSetting has it of each setting.
struct ColumnFront {
  std::vector<std::optional<double>> behind;
  std::vector<bool> on_front;
  std::vector<bool> may_be;
};

ColumnFront column_front(std::span<const CommonSetting> settings, std::size_t column, std::size_t metric,
                         const HardwareOptions& options) {
  const std::size_t n = settings.size();
  ColumnFront front{.behind = std::vector<std::optional<double>>(n),
                    .on_front = std::vector<bool>(n),
                    .may_be = std::vector<bool>(n)};
  std::vector<std::size_t> within;
  std::vector<double> times;
  std::vector<double> errors;
  for (std::size_t i = 0; i < n; ++i) {
    const TableRow& row = *settings[i].times[column]->rows.front();
    const auto value_of = [&](const Budget& budget) { return row.errors[find_metric(budget.metric).place]; };
    if (!miss_of(options.constraints, value_of).text.empty()) continue;
    within.push_back(i);
    times.push_back(settings[i].times[column]->log_time);
    errors.push_back(*row.errors[metric]);
  }
  for (const std::size_t k : pareto_front(times, errors)) front.on_front[within[k]] = true;
  // By rising error the fastest so far is the fastest that is as accurate.
  std::vector<std::size_t> order(within.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::ranges::sort(order, {}, [&](std::size_t k) { return std::pair(errors[k], times[k]); });
  const SettingTime* fastest = nullptr;
  for (const std::size_t k : order) {
    const SettingTime& own = *settings[within[k]].times[column];
    if (fastest == nullptr || own.log_time < fastest->log_time) fastest = &own;
    const double behind = own.log_time - fastest->log_time;
    const double df = std::clamp(std::min(own.df, fastest->df), 1.0, static_cast<double>(kMostDf));
    const double t = student_t_quantile(1 - options.confidence, static_cast<int>(df));
    front.behind[within[k]] = std::expm1(behind);
    front.may_be[within[k]] = behind <= t * std::sqrt(own.variance + fastest->variance);
  }
  return front;
}

}  // namespace

SceneFronts scene_fronts(std::span<const FrontColumn> columns, const HardwareOptions& options) {
  const std::size_t metric = find_metric(options.error_metric).place;
  const std::vector<CommonSetting> settings = common_settings_of(columns, metric);
  SceneFronts fronts{.scene = columns.front().scene, .columns = {}, .settings = settings.size(), .on_some = {}};
  std::vector<ColumnFront> by_column;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    fronts.columns.push_back(columns[c].column);
    by_column.push_back(column_front(settings, c, metric, options));
  }
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < settings.size(); ++i)
    if (std::ranges::any_of(by_column, [i](const ColumnFront& front) { return front.on_front[i]; }))
      order.emplace_back(settings[i].times.front()->log_time, i);
  std::ranges::sort(order);
  for (const auto& [time, i] : order) {
    FrontSetting one{.settings = settings[i].times.front()->rows.front()->settings,
                     .errors = {},
                     .rows = {},
                     .behind = {},
                     .on_front = {},
                     .may_be = {}};
    for (std::size_t c = 0; c < columns.size(); ++c) {
      one.rows.push_back(settings[i].times[c]->rows.front());
      one.errors.push_back(*one.rows.back()->errors[metric]);
      one.behind.push_back(by_column[c].behind[i]);
      one.on_front.push_back(by_column[c].on_front[i]);
      one.may_be.push_back(by_column[c].may_be[i]);
    }
    fronts.on_some.push_back(std::move(one));
  }
  return fronts;
}

}  // namespace reliefbench
