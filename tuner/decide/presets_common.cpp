#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "kernels/base/error.h"
#include "tuner/decide/pareto.h"
#include "tuner/decide/preset_levels.h"
#include "tuner/decide/presets.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

/// A row of a run's table beside the record that it was made of.
PresetEvidence evidence_of(const TableRow& row, std::span<const Run> runs, std::span<const FleetRun> fleet,
                           const std::string& error_metric) {
  for (std::size_t i = 0; i < runs.size(); ++i)
    for (std::size_t k = 0; k < fleet[i].rows.size(); ++k)
      if (&fleet[i].rows[k] == &row)
        return {.run = &runs[i],
                .record = &runs[i].records[k],
                .error = row.errors[find_metric(error_metric).place].value_or(std::numeric_limits<double>::infinity())};
  fail_input("case {} is of none of the runs", row.case_id);
}

double worst_error(const FleetSetting& setting, const std::string& metric) {
  double worst = 0;
  for (const Loss& loss : setting.losses)
    worst =
        std::max(worst, loss.row->errors[find_metric(metric).place].value_or(std::numeric_limits<double>::infinity()));
  return worst;
}

/// Whether a setting may be the level below another: nowhere slower, and not more accurate.
bool keeps_order(const FleetSetting& setting, const FleetSetting& above, const std::string& level_metric) {
  for (std::size_t p = 0; p < setting.losses.size(); ++p)
    if (setting.losses[p].time_ns > above.losses[p].time_ns) return false;
  return worst_error(setting, level_metric) >= worst_error(above, level_metric);
}

/// The constraints, with a value of every metric that levels are told by.
std::vector<Budget> budgets_of(const Presets& presets) {
  std::vector<Budget> budgets = presets.constraints;
  for (const std::string& metric : {presets.error_metric, presets.level_metric})
    budgets.push_back({metric, std::numeric_limits<double>::infinity()});
  return budgets;
}

std::vector<LevelSetting<FleetSetting>> common_levels(const Fleet& all, std::span<const FleetRun> fleet,
                                                      const Presets& presets, Regret regret) {
  LevelRange range{.loosest = worst_error(all.settings.front(), presets.level_metric)};
  range.least = range.loosest;
  for (const FleetSetting& one : all.settings)
    range.least = std::min(range.least, worst_error(one, presets.level_metric));
  const auto pick = [&](double limit, const FleetSetting* above) {
    std::vector<Budget> budgets = budgets_of(presets);
    budgets.push_back({presets.level_metric, limit});
    const Fleet asked = choose_for_fleet(fleet, {.budgets = budgets, .regret = regret});
    return *std::ranges::find_if(asked.settings, [&](const FleetSetting& one) {
      return above == nullptr || one.settings == above->settings || keeps_order(one, *above, presets.level_metric);
    });
  };
  const auto is_same = [](const FleetSetting& a, const FleetSetting& b) { return a.settings == b.settings; };
  return levels_of<FleetSetting>(range, presets, pick, is_same);
}

/// The levels as one device has them, so that whoever reads presets finds them as usual.
DevicePresets device_of_fleet(const MeasuredDevice& device, const Fleet& all, const Presets& presets,
                              std::span<const Run> runs, std::span<const FleetRun> fleet) {
  DevicePresets result{
      .backend = device.backend, .device = device.device, .driver = device.driver, .scenes = {}, .levels = {}};
  std::vector<std::size_t> places;
  for (std::size_t p = 0; p < all.places.size(); ++p)
    if (all.places[p].device == device) places.push_back(p);
  std::set<std::string> measured;
  for (const FleetRun& run : fleet)
    for (const TableRow& row : run.rows)
      if (row.status == Status::ok && row.backend == device.backend && row.device == device.device)
        measured.insert(setting_id(row.settings));
  result.measured = static_cast<int>(measured.size());
  result.shared = static_cast<int>(all.settings.size());
  result.feasible = result.shared;
  std::vector<double> times;
  std::vector<double> errors;
  for (const FleetSetting& one : all.settings) {
    times.push_back(one.combined.value);
    errors.push_back(worst_error(one, presets.level_metric));
  }
  result.on_front = static_cast<int>(pareto_front(times, errors).size());
  for (const std::size_t p : places) {
    const Loss& own = *all.own[p].losses[p];
    result.scenes.push_back(
        {.scene = all.places[p].scene, .fastest = evidence_of(*own.row, runs, fleet, presets.error_metric).record});
  }
  for (const CommonLevel& level : presets.common->levels) {
    PresetLevel& made = result.levels.emplace_back();
    made.quality = level.quality;
    made.level_error = level.level_error;
    for (const std::size_t p : places) {
      const Loss& loss = level.losses[p];
      made.evidence.push_back(evidence_of(*loss.row, runs, fleet, presets.error_metric));
      made.error = std::max(made.error, made.evidence.back().error);
      made.relative_time = std::max(made.relative_time, loss.time_ns / all.own[p].losses[p]->time_ns);
    }
  }
  return result;
}

}  // namespace

Presets make_common_presets(std::span<const Run> runs, std::span<const FleetRun> fleet, const PresetQuery& query,
                            Regret regret) {
  Presets presets = asked_presets(runs, query);
  const Fleet all = choose_for_fleet(fleet, {.budgets = budgets_of(presets), .regret = regret});
  presets.warnings = all.repeated;
  for (const FleetPlace& a : all.places)
    for (const FleetPlace& b : all.places)
      if (a.device.backend == b.device.backend && a.device.device == b.device.device && !(a.device == b.device))
        fail_input("{} was measured with two drivers or on two machines ('{}', '{}'); their times make no one table",
                   a.device.device, a.device.driver, b.device.driver);
  presets.common = CommonPresets{.regret = regret, .places = all.places, .levels = {}};
  for (auto& [quality, setting] : common_levels(all, fleet, presets, regret))
    presets.common->levels.push_back({.quality = quality,
                                      .level_error = worst_error(setting, presets.level_metric),
                                      .losses = std::move(setting.losses),
                                      .combined = setting.combined});
  warn_of_few_levels(presets, fmt::format("{} places", all.places.size()), presets.common->levels.size(),
                     all.settings.size());
  std::vector<MeasuredDevice> devices;
  for (const FleetPlace& place : all.places)
    if (std::ranges::find(devices, place.device) == devices.end()) devices.push_back(place.device);
  for (const MeasuredDevice& device : devices)
    presets.devices.push_back(device_of_fleet(device, all, presets, runs, fleet));
  return presets;
}

}  // namespace reliefbench
