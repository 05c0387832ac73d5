#include "tuner/decide/hardware.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tuner/decide/case_groups.h"
#include "tuner/decide/hardware_fronts.h"
#include "tuner/decide/place_times.h"
#include "tuner/results/coarse_filter.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

/// A case on both devices.
struct BothTimes {
  const std::string* setting;
  const SettingTime* base;
  const SettingTime* now;
};

/// What one device's samples contribute to the error of a mean over cases: by index, so that what was drawn together
/// does not count as independent.
struct MeanError {
  double variance = 0;
  double df = 0;
};
MeanError mean_error(std::span<const BothTimes> all, std::span<const std::size_t> members,
                     const SettingTime* BothTimes::*side) {
  const auto n = static_cast<double>(members.size());
  double independent = 0;
  std::map<std::pair<std::size_t, std::size_t>, double> by_index;  // run, sample
  for (const std::size_t i : members) {
    const SettingTime& time = *(all[i].*side);
    independent += time.variance / (n * n);
    for (std::size_t run = 0; run < time.errors.size(); ++run)
      for (std::size_t k = 0; k < time.errors[run].size(); ++k) by_index[{run, k}] += time.errors[run][k] / n;
  }
  double together = 0;
  for (const auto& [place, error] : by_index) together += error * error;
  return {.variance = std::max(together, independent), .df = std::max(1.0, static_cast<double>(by_index.size()) - 1)};
}

RatioInterval interval_of(double log_ratio, double variance, double df, double confidence) {
  const double t = student_t_quantile(1 - confidence, std::clamp(static_cast<int>(df), 1, kMostDf));
  const double margin = variance > 0 ? t * std::sqrt(variance) : 0;
  return {.ratio = std::exp(log_ratio), .low = std::exp(log_ratio - margin), .high = std::exp(log_ratio + margin)};
}

double quantile(std::vector<double> sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], at - static_cast<double>(below));
}

/// What shifts all cases of a run together, as far as a device has several runs: of its scene that shows the most.
struct SharedShift {
  double base = 0;  ///< variances of the mean over the runs
  double now = 0;
  double df = kMostDf;

  void add(const PlaceTimes& times, double& side) {
    if (!times.shared_variance) return;
    side = std::max(side, *times.shared_variance);
    df = std::min(df, times.shared_df);
  }
};

class HardwareTable {
 public:
  HardwareTable(std::span<const FleetRun> runs, const HardwareOptions& options) : options_(options) {
    places_ = places_of(runs);
    for (const MeasuredPlace& place : places_)
      times_.push_back(place_times(place, runs, [](const TableRow& row) { return row.status == Status::ok; }));
    for (std::size_t p = 0; p < places_.size(); ++p) add_to_column(p);
  }

  [[nodiscard]] const std::vector<DeviceColumn>& columns() const { return columns_; }

  [[nodiscard]] DevicePair pair(std::size_t base, std::size_t now) const {
    DevicePair pair{.base = base, .now = now, .groups = {}, .cases = {}, .ranks = {}};
    std::vector<BothTimes> all;
    SharedShift shared;
    for (const std::size_t a : column_places_[base])
      for (const std::size_t b : column_places_[now]) {
        if (!is_same_scene(a, b)) continue;
        const std::size_t first = all.size();
        for (const auto& [id, time] : times_[a].settings)
          if (const auto other = times_[b].settings.find(id); other != times_[b].settings.end())
            all.push_back({.setting = &id, .base = &time, .now = &other->second});
        add_scene(std::span(all).subspan(first), a, pair);
        shared.add(times_[a], shared.base);
        shared.add(times_[b], shared.now);
      }
    add_groups(all, {.variance = shared.base + shared.now, .df = shared.df}, pair);
    std::ranges::stable_sort(pair.cases, {}, [](const PairCase& one) { return one.ratio.ratio; });
    return pair;
  }

  [[nodiscard]] std::vector<SceneFronts> fronts() const {
    std::vector<SceneFronts> result;
    for (const std::vector<FrontColumn>& columns : scenes())
      if (columns.size() > 1) result.push_back(scene_fronts(columns, options_));
    return result;
  }

  /// Scenes that only one column has.
  [[nodiscard]] std::vector<std::string> lone_scenes() const {
    std::vector<std::string> lone;
    for (const std::vector<FrontColumn>& columns : scenes())
      if (columns.size() == 1) lone.push_back(columns.front().scene);
    return lone;
  }

  [[nodiscard]] std::vector<std::string> repeated(std::span<const FleetRun> runs) const {
    return repeated_texts(places_, runs);
  }

 private:
  /// By key; by name where one of them has none.
  [[nodiscard]] bool is_same_scene(std::size_t a, std::size_t b) const {
    const MeasuredPlace& first = places_[a];
    const MeasuredPlace& second = places_[b];
    const bool has_keys = first.scene_key.is_known() && second.scene_key.is_known();
    return has_keys ? first.scene_key == second.scene_key : first.scene == second.scene;
  }

  /// Of each scene the columns that have it. One without a key is among all scenes of its name, or by itself.
  [[nodiscard]] std::vector<std::vector<FrontColumn>> scenes() const {
    std::map<std::string, std::size_t> of_scene;  // by key, or else name: a place of it
    for (std::size_t p = 0; p < places_.size(); ++p) {
      const bool is_known = places_[p].scene_key.is_known();
      const auto has_name = [&](const MeasuredPlace& other) {
        return other.scene_key.is_known() && other.scene == places_[p].scene;
      };
      if (!is_known && std::ranges::any_of(places_, has_name)) continue;
      of_scene.emplace(is_known ? places_[p].scene_key.hex : places_[p].scene, p);
    }
    std::vector<std::vector<FrontColumn>> scenes;
    for (const auto& [scene, place] : of_scene) {
      scenes.emplace_back();
      for (std::size_t c = 0; c < columns_.size(); ++c)
        for (const std::size_t p : column_places_[c])
          if (is_same_scene(place, p))
            scenes.back().push_back({.column = c, .scene = places_[p].scene, .times = &times_[p]});
    }
    return scenes;
  }

  void add_to_column(std::size_t p) {
    const MeasuredPlace& place = places_[p];
    auto found = std::ranges::find(columns_, place.device, &DeviceColumn::device);
    if (found == columns_.end()) {
      columns_.push_back({.device = place.device, .runs = {}, .cases = 0, .between_runs = {}});
      column_places_.emplace_back();
      found = std::prev(columns_.end());
    }
    for (const std::size_t run : place.runs)
      if (std::ranges::find(found->runs, run) == found->runs.end()) found->runs.push_back(run);
    found->cases += times_[p].settings.size();
    if (times_[p].between_runs)
      found->between_runs = std::max(found->between_runs.value_or(0), *times_[p].between_runs);
    column_places_[static_cast<std::size_t>(found - columns_.begin())].push_back(p);
  }

  void add_scene(std::span<const BothTimes> cases, std::size_t place, DevicePair& pair) const {
    if (cases.empty()) return;
    std::vector<double> base;
    std::vector<double> now;
    for (const BothTimes& both : cases) {
      base.push_back(both.base->log_time);
      now.push_back(both.now->log_time);
      pair.cases.push_back({.setting = *both.setting,
                            .scene = places_[place].scene,
                            .ratio = interval_of(now.back() - base.back(), both.base->variance + both.now->variance,
                                                 std::min(both.base->df, both.now->df), options_.confidence),
                            .base_ns = std::exp(base.back()),
                            .now_ns = std::exp(now.back())});
    }
    RankCorrelation rank = rank_correlation(base, now, options_.confidence);
    rank.scene = places_[place].scene;
    pair.ranks.push_back(std::move(rank));
  }

  void add_groups(std::span<const BothTimes> all, const MeanError& shared, DevicePair& pair) const {
    std::vector<CaseTraits> traits;
    std::vector<double> ratios;
    for (const BothTimes& both : all) {
      const TableRow& row = *both.base->rows.front();
      const Param* const format = row.settings.technique().find("format");
      traits.push_back({.technique = std::string(row.settings.technique().id),
                        .map = row.map,
                        .format = format == nullptr ? std::string() : format->text(row.settings.get("format"))});
      ratios.push_back(both.now->log_time - both.base->log_time);
    }
    auto groups = case_groups(traits);
    if (all.size() == 1) groups.emplace_back("", std::vector<std::size_t>{0});
    for (const auto& [name, members] : groups) {
      const MeanError base = mean_error(all, members, &BothTimes::base);
      const MeanError now = mean_error(all, members, &BothTimes::now);
      double mean = 0;
      std::vector<double> own;
      for (const std::size_t i : members) {
        mean += ratios[i] / static_cast<double>(members.size());
        own.push_back(std::exp(ratios[i]));
      }
      std::ranges::sort(own);
      const double sampling = base.variance + now.variance;
      // What is shared by all cases of a run was seen as often as there are runs.
      const double df = shared.variance > sampling ? shared.df : std::min(base.df, now.df);
      pair.groups.push_back({.group = name.empty() ? "all" : name,
                             .cases = members.size(),
                             .ratio = interval_of(mean, sampling + shared.variance, df, options_.confidence),
                             .low_case = quantile(own, 0.05),
                             .high_case = quantile(own, 0.95)});
    }
  }

  const HardwareOptions& options_;
  std::vector<MeasuredPlace> places_;
  std::vector<PlaceTimes> times_;
  std::vector<DeviceColumn> columns_;
  std::vector<std::vector<std::size_t>> column_places_;
};

/// Which columns are held against each other.
std::vector<std::pair<std::size_t, std::size_t>> pairs_of(std::span<const DeviceColumn> columns, bool across_backends) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < columns.size(); ++a)
    for (std::size_t b = a + 1; b < columns.size(); ++b)
      if (across_backends || columns[a].device.backend == columns[b].device.backend) pairs.emplace_back(a, b);
  return pairs.empty() && !across_backends ? pairs_of(columns, true) : pairs;
}

}  // namespace

HardwareComparison compare_hardware(std::span<const FleetRun> runs, const HardwareOptions& options) {
  if (!find_metric(options.error_metric).lower_is_better)
    fail_input("'{}' is no error: higher is better", options.error_metric);
  const HardwareTable table(runs, options);
  HardwareComparison comparison;
  comparison.columns = table.columns();
  if (comparison.columns.size() < 2)
    fail_input(
        "all runs are of one device and backend{}: `compare` holds two run folders of one against each other, `track` "
        "follows more",
        comparison.columns.empty() ? "" : fmt::format(", {}", column_text(comparison, 0)));
  for (const auto& [a, b] : pairs_of(comparison.columns, options.across_backends)) {
    DevicePair pair = table.pair(a, b);
    if (!pair.cases.empty()) comparison.pairs.push_back(std::move(pair));
  }
  comparison.fronts = table.fronts();
  std::vector<Environment> environments;
  for (const DeviceColumn& column : comparison.columns) {
    environments.push_back(measured_environment(runs[column.runs.front()].info, column.device.backend));
    if (trait(environments.back(), "device").empty())
      environments.back().emplace(environments.back().begin(), "device", column.device.device);
    environments.back().emplace(environments.back().begin(), "backend", column.device.backend);
  }
  comparison.environment = environment_differences(environments);
  comparison.warnings = table.repeated(runs);
  if (const std::vector<std::string> lone = table.lone_scenes(); !lone.empty())
    comparison.warnings.push_back(
        fmt::format("only one device has the scene{} {}: not compared (another heightmap, depth, view or frame size is "
                    "another scene)",
                    lone.size() > 1 ? "s" : "", fmt::join(lone, ", ")));
  return comparison;
}

std::set<std::string> coarse_notes(const HardwareComparison& comparison) {
  std::vector<const TableRow*> rows;
  for (const SceneFronts& scene : comparison.fronts)
    for (const FrontSetting& one : scene.on_some) rows.insert(rows.end(), one.rows.begin(), one.rows.end());
  return coarse_notes(rows);
}

Exit exit_of(const HardwareComparison& comparison) {
  return comparison.pairs.empty() ? Exit::nothing_measured : Exit::done;
}

std::string column_letter(std::size_t column) {
  return column < 26 ? std::string(1, static_cast<char>('A' + column)) : std::to_string(column);
}

std::string column_text(const HardwareComparison& comparison, std::size_t column) {
  std::vector<MeasuredDevice> devices;
  for (const DeviceColumn& one : comparison.columns) devices.push_back(one.device);
  return fmt::format("{} {}", column_letter(column), device_text(devices[column], devices));
}

}  // namespace reliefbench
