#include "tuner/decide/compare.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "tuner/decide/pareto.h"
#include "tuner/plan/scene_json.h"

namespace reliefbench {
namespace {

/// By what is matched between runs. A run that measured one scene under two names has each case twice: then by their
/// order, too.
using RecordsByKey = std::map<std::pair<std::string, int>, const Record*>;

RecordsByKey by_key(const Run& run) {
  RecordsByKey result;
  std::map<std::string, int> seen;
  for (const Record& record : run.records) {
    std::string key = match_key(record);
    const int place = seen[key]++;
    result[{std::move(key), place}] = &record;
  }
  return result;
}

/// backend -> "name, driver"
std::map<std::string, std::string> device_names(const Run& run) {
  std::map<std::string, std::string> names;
  try {
    for (const nlohmann::json& device : run.info.at("identity").at("devices")) {
      names[device.at("backend")] =
          fmt::format("{}, {}", device.at("name").get<std::string>(), device.at("driver").get<std::string>());
    }
  } catch (const nlohmann::json::exception&) {
    fail_input("{}: key 'identity.devices': expected a list of backend, name and driver",
               (run.folder / "run.json").string());
  }
  return names;
}

void check_devices(const Run& base, const Run& now) {
  const std::map<std::string, std::string> base_names = device_names(base);
  for (const auto& [backend, name] : device_names(now)) {
    const auto other = base_names.find(backend);
    if (other == base_names.end() || other->second == name) continue;
    fail_input("the runs are of different devices on {}: {} is of {}; {} is of {}", backend, base.folder.string(),
               other->second, now.folder.string(), name);
  }
}

/// Another host matters less than another device, whose name and driver are checked, but more than nothing.
void warn_of_host(const Run& base, const Run& now, Comparison& comparison) {
  const auto host = [](const Run& run, const std::string& key) {
    return run.info.value(nlohmann::json::json_pointer("/host/" + key), std::string("unknown"));
  };
  for (const std::string key : {"cpu", "os"}) {
    if (host(base, key) == host(now, key)) continue;
    comparison.warnings.push_back(
        fmt::format("the host's {} differs: {}, now {}", key, host(base, key), host(now, key)));
  }
}

/// Names that mean another scene in each run, which explains why their cases do not match.
void warn_of_scenes(const Run& base, const Run& now, Comparison& comparison) {
  for (const MeasuredScene& before : base.scenes)
    for (const MeasuredScene& after : now.scenes)
      if (before.spec.id == after.spec.id && before.key != after.key)
        comparison.warnings.push_back(fmt::format("scene '{}' is not the same, its cases are not compared: {}",
                                                  before.spec.id, difference_text(before, after)));
}

std::vector<CaseMatch> match_cases(const Run& base, const Run& now, Comparison& comparison) {
  const RecordsByKey before = by_key(base);
  const RecordsByKey after = by_key(now);
  std::vector<CaseMatch> matches;
  for (const auto& [key, old] : before) {
    const auto other = after.find(key);
    if (other == after.end()) {
      comparison.only_base.push_back(old->case_id);
    } else if (old->status == Status::ok && other->second->status == Status::ok) {
      matches.push_back({old, other->second});
    } else if (old->status == Status::ok) {
      comparison.lost.push_back(
          fmt::format("{}: {} {}", old->case_id, status_id(other->second->status), other->second->reason));
    }
  }
  for (const auto& [key, record] : after) {
    if (!before.contains(key)) comparison.only_new.push_back(record->case_id);
  }
  comparison.matched = matches.size();
  warn_of_scenes(base, now, comparison);
  return matches;
}

bool is_worse(const MetricRow& metric, std::optional<double> base, std::optional<double> now) {
  if (!base || !now) return now.has_value();  // where none is best
  return metric.lower_is_better ? *now > *base : *now < *base;
}

void compare_errors(std::span<const CaseMatch> matches, std::string_view only_metric, Comparison& comparison) {
  for (const MetricRow& metric : metrics()) {
    if (!only_metric.empty() && metric.id != only_metric) continue;
    for (const CaseMatch& match : matches) {
      const std::optional<double> base = metric_value(*match.base, metric.id);
      const std::optional<double> now = metric_value(*match.now, metric.id);
      if (base == now) continue;
      if (!metric.none_is_best() && (!base || !now)) continue;  // one run did not measure it
      comparison.errors.push_back({.case_id = match.base->case_id,
                                   .metric = std::string(metric.id),
                                   .base = base,
                                   .now = now,
                                   .worse = !metric.counts_work && is_worse(metric, base, now),
                                   .counts_work = metric.counts_work});
    }
  }
}

nlohmann::json or_null(std::optional<double> value) { return value ? nlohmann::json(*value) : nlohmann::json(); }

/// JSON has no infinity: an unbounded end is null.
nlohmann::json time_change_json(const TimeChange& change) {
  const auto end = [](double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); };
  return {{"ratio", change.ratio.ratio},
          {"ci", {end(change.ratio.low), end(change.ratio.high)}},
          {"p", change.p},
          {"change", change_id(change.change)}};
}

}  // namespace

std::string_view error_change_id(const ErrorChange& change) {
  if (change.counts_work) return change.now > change.base ? "more" : "fewer";
  return change.worse ? "worse" : "better";
}

std::string_view change_id(Change change) {
  switch (change) {
    case Change::faster:
      return "faster";
    case Change::slower:
      return "slower";
    case Change::same:
      return "same";
    case Change::unclear:
      return "unclear";
  }
  return "unclear";
}

Comparison compare_runs(const Run& base, const Run& now, const CompareOptions& options) {
  const bool of_time = options.metric == "frame_time" || options.metric == "frame_time_raw";
  if (!of_time) (void)find_metric(options.metric);
  Comparison comparison;
  comparison.metric = options.metric;
  check_devices(base, now);
  warn_of_host(base, now, comparison);
  const std::vector<CaseMatch> matches = match_cases(base, now, comparison);
  compare_errors(matches, of_time ? "" : options.metric, comparison);
  if (of_time && !matches.empty()) compare_times(base, now, matches, options, comparison);
  return comparison;
}

bool is_inconclusive(const Comparison& comparison) {
  const auto is_unclear = [](const TimeChange& change) { return change.change == Change::unclear; };
  const auto unclear = std::ranges::count_if(comparison.cases, is_unclear);
  return std::ranges::any_of(comparison.groups, is_unclear) ||
         2 * static_cast<std::size_t>(unclear) > comparison.cases.size();
}

Exit exit_of(const Comparison& comparison) {
  const auto is_slower = [](const TimeChange& change) { return change.change == Change::slower; };
  if (std::ranges::any_of(comparison.cases, is_slower) || std::ranges::any_of(comparison.groups, is_slower) ||
      std::ranges::any_of(comparison.errors, &ErrorChange::worse) || !comparison.lost.empty())
    return Exit::answer_is_no;
  if (comparison.matched == 0) return Exit::nothing_measured;
  return is_inconclusive(comparison) ? Exit::inconclusive : Exit::done;
}

nlohmann::json comparison_json(const Comparison& comparison) {
  nlohmann::json cases = nlohmann::json::array();
  for (const CaseChange& c : comparison.cases) {
    cases.push_back(time_change_json(c));
    cases.back()["case"] = c.case_id;
  }
  nlohmann::json groups = nlohmann::json::array();
  for (const GroupChange& group : comparison.groups) {
    groups.push_back(time_change_json(group));
    groups.back().update({{"group", group.group}, {"cases", group.cases}});
  }
  nlohmann::json errors = nlohmann::json::array();
  for (const ErrorChange& e : comparison.errors) {
    errors.push_back({{"case", e.case_id},
                      {"metric", e.metric},
                      {"base", or_null(e.base)},
                      {"new", or_null(e.now)},
                      {"change", error_change_id(e)}});
  }
  nlohmann::json control = nlohmann::json::object();
  for (const auto& [backend, ratio] : comparison.control_ratio) control[backend] = ratio;
  nlohmann::json between_runs = nlohmann::json::object();
  for (const auto& [backend, deviation] : comparison.between_runs) between_runs[backend] = deviation;
  return {{"schema", kSchemaVersion},
          {"metric", comparison.metric},
          {"matched", comparison.matched},
          {"geometric_mean", comparison.groups.empty() ? 1.0 : comparison.groups.front().ratio.ratio},
          {"inconclusive", is_inconclusive(comparison)},
          {"control_ratio", std::move(control)},
          {"between_runs", std::move(between_runs)},
          {"assumed", comparison.assumed},
          {"groups", std::move(groups)},
          {"cases", std::move(cases)},
          {"errors", std::move(errors)},
          {"lost", comparison.lost},
          {"only_base", comparison.only_base},
          {"only_new", comparison.only_new},
          {"warnings", comparison.warnings}};
}

}  // namespace reliefbench
