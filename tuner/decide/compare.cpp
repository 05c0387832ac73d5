#include "tuner/decide/compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "tuner/decide/pareto.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/run_parts.h"

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

void check_devices(const Run& base, const Run& now, bool across_drivers, Comparison& comparison) {
  const auto base_devices = named_devices(base);
  for (const auto& [backend, device] : named_devices(now)) {
    const auto other = base_devices.find(backend);
    if (other == base_devices.end() || other->second == device) continue;
    const bool is_same_device = other->second.name == device.name;
    if (is_same_device && across_drivers) {
      comparison.drivers.push_back(fmt::format("{}: {}, now {}", backend, other->second.driver, device.driver));
      continue;
    }
    fail_input("the runs are of different {} on {}: {} is of {}, {}; {} is of {}, {}{}",
               is_same_device ? "drivers" : "devices", backend, base.folder.string(), other->second.name,
               other->second.driver, now.folder.string(), device.name, device.driver,
               is_same_device ? "; --across-drivers compares them all the same" : "");
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

/// A new run that was stopped: what it lacks is not lost, but nothing is known of it yet.
void warn_of_unfinished(const Run& now, Comparison& comparison) {
  if (comparison.only_base.empty() || !now.info.contains("finished") || !now.info["finished"].is_null()) return;
  comparison.is_unfinished = true;
  comparison.warnings.push_back(fmt::format("{} is not finished and lacks {} cases of the base: {}",
                                            now.folder.string(), comparison.only_base.size(), how_to_finish(now)));
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

/// What the runs differ in, of the backends that both have.
void add_environment(const Run& base, const Run& now, Comparison& comparison) {
  const auto before = named_devices(base);
  for (const auto& [backend, device] : named_devices(now)) {
    if (!before.contains(backend)) continue;
    const std::array environments = {measured_environment(base.info, backend), measured_environment(now.info, backend)};
    for (EnvironmentDifference& difference : environment_differences(environments)) {
      const auto is_it = [&](const EnvironmentDifference& other) {
        return other.what == difference.what && other.values == difference.values;
      };
      if (std::ranges::none_of(comparison.environment, is_it)) comparison.environment.push_back(std::move(difference));
    }
  }
}

}  // namespace

std::map<std::string, NamedDevice> named_devices(const Run& run) {
  std::map<std::string, NamedDevice> devices;
  try {
    for (const nlohmann::json& device : run.info.at("identity").at("devices"))
      devices[device.at("backend")] = {.name = device.at("name"), .driver = device.at("driver")};
  } catch (const nlohmann::json::exception&) {
    fail_input("{}: key 'identity.devices': expected a list of backend, name and driver",
               (run.folder / "run.json").string());
  }
  return devices;
}

Comparison compare_runs(const Run& base, const Run& now, const CompareOptions& options) {
  const bool of_time = options.metric == "frame_time" || options.metric == "frame_time_raw";
  if (!of_time) (void)find_metric(options.metric);
  Comparison comparison;
  comparison.metric = options.metric;
  check_devices(base, now, options.across_drivers, comparison);
  warn_of_host(base, now, comparison);
  add_environment(base, now, comparison);
  const std::vector<CaseMatch> matches = match_cases(base, now, comparison);
  warn_of_unfinished(now, comparison);
  compare_errors(matches, of_time ? "" : options.metric, comparison);
  if (of_time && !matches.empty()) compare_times(base, now, matches, options, comparison);
  return comparison;
}

void set_remeasured(TimeChange& change, double log_ratio, double low, double high, double threshold) {
  change.ratio = {.ratio = std::exp(log_ratio), .low = std::exp(low), .high = std::exp(high)};
  const double limit = std::log(1 + threshold);
  if (low >= -limit && high <= limit)
    change.change = Change::same;
  else if (low > 0)
    change.change = Change::slower;
  else
    change.change = high < 0 ? Change::faster : Change::unclear;
  change.reason = change.change == Change::unclear ? Reason::remeasured_too_little : Reason::remeasured;
}

bool is_doubtful(const TimeChange& change) {
  return change.change == Change::unclear || change.reason == Reason::control_drift;
}

bool is_inconclusive(const Comparison& comparison) {
  if (comparison.is_unfinished) return true;
  const auto is_unclear = [](const TimeChange& change) { return change.change == Change::unclear; };
  const auto unclear = std::ranges::count_if(comparison.cases, is_unclear);
  return std::ranges::any_of(comparison.groups, is_unclear) ||
         2 * static_cast<std::size_t>(unclear) > comparison.cases.size();
}

std::string_view verdict_id(const Comparison& comparison) {
  const auto is_slower = [](const TimeChange& change) { return change.change == Change::slower; };
  if (std::ranges::any_of(comparison.cases, is_slower) || std::ranges::any_of(comparison.groups, is_slower))
    return "slower";
  if (std::ranges::any_of(comparison.errors, &ErrorChange::worse)) return "worse_errors";
  if (!comparison.lost.empty()) return "lost";
  if (comparison.matched == 0) return "nothing_matched";
  if (is_inconclusive(comparison)) return "inconclusive";
  const auto is_faster = [](const TimeChange& change) { return change.change == Change::faster; };
  const bool has_faster =
      std::ranges::any_of(comparison.cases, is_faster) || std::ranges::any_of(comparison.groups, is_faster);
  return has_faster ? "faster" : "same";
}

Exit exit_of(const Comparison& comparison) {
  const std::string_view verdict = verdict_id(comparison);
  if (verdict == "slower" || verdict == "worse_errors" || verdict == "lost") return Exit::answer_is_no;
  if (verdict == "nothing_matched") return Exit::nothing_measured;
  return verdict == "inconclusive" ? Exit::inconclusive : Exit::done;
}

}  // namespace reliefbench
