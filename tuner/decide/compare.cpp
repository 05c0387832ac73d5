#include "tuner/decide/compare.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "tuner/decide/pareto.h"
#include "tuner/results/relative_time.h"

namespace reliefbench {
namespace {

using RecordsById = std::map<std::string, const Record*, std::less<>>;

struct Match {
  const Record* base;
  const Record* now;
};

RecordsById by_id(const Run& run) {
  RecordsById result;
  for (const Record& record : run.records) result[record.case_id] = &record;
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

std::vector<Match> match_cases(const Run& base, const Run& now, Comparison& comparison) {
  const RecordsById before = by_id(base);
  const RecordsById after = by_id(now);
  std::vector<Match> matches;
  for (const auto& [id, old] : before) {
    const auto other = after.find(id);
    if (other == after.end()) {
      comparison.only_base.push_back(id);
    } else if (old->status == Status::ok && other->second->status == Status::ok) {
      matches.push_back({old, other->second});
    } else if (old->status == Status::ok) {
      comparison.lost.push_back(fmt::format("{}: {} {}", id, status_id(other->second->status), other->second->reason));
    }
  }
  for (const auto& [id, record] : after) {
    if (!before.contains(id)) comparison.only_new.push_back(id);
  }
  comparison.matched = matches.size();
  return matches;
}

bool is_worse(const MetricRow& metric, std::optional<double> base, std::optional<double> now) {
  if (!base || !now) return now.has_value();  // where none is best
  return metric.lower_is_better ? *now > *base : *now < *base;
}

void compare_errors(std::span<const Match> matches, std::string_view only_metric, Comparison& comparison) {
  for (const MetricRow& metric : metrics()) {
    if (!only_metric.empty() && metric.id != only_metric) continue;
    for (const Match& match : matches) {
      const std::optional<double> base = metric_value(*match.base, metric.id);
      const std::optional<double> now = metric_value(*match.now, metric.id);
      if (base == now) continue;
      if (!metric.none_is_best() && (!base || !now)) continue;  // one run did not measure it
      comparison.errors.push_back({.case_id = match.base->case_id,
                                   .metric = std::string(metric.id),
                                   .base = base,
                                   .now = now,
                                   .worse = is_worse(metric, base, now)});
    }
  }
}

/// The samples of one run, ready to be asked for a case's times.
class CaseTimes {
 public:
  explicit CaseTimes(const Run& run) : folder_(run.folder), samples_(group_samples(run.samples)) {}

  [[nodiscard]] const std::vector<Sample>* find(std::string_view case_id) const {
    const auto found = samples_.find(case_id);
    return found == samples_.end() ? nullptr : &found->second;
  }

  /// ns, or with a control case a plain ratio.
  [[nodiscard]] std::vector<double> of(const Record& record, bool relative) const {
    const std::vector<Sample>* samples = find(record.case_id);
    if (samples == nullptr) {
      fail_input("{}: no samples of case {}", (folder_ / "samples.jsonl").string(), record.case_id);
    }
    return relative ? relative_times(*samples, *find(control_case_id(record.backend))) : raw_times(*samples);
  }

 private:
  std::filesystem::path folder_;
  SamplesByCase samples_;
};

/// The least two-sided p that Mann-Whitney can reach: 2 / (a + b choose a), when every a is under every b.
double least_p(std::size_t a, std::size_t b) {
  double p = 2;
  for (std::size_t i = 1; i <= a; ++i) p *= static_cast<double>(i) / static_cast<double>(b + i);
  return p;
}

Change judge(const CaseChange& c, const CompareOptions& options) {
  const double upper = 1 + options.threshold;
  const double lower = 1 / upper;
  if (c.ratio.low >= lower && c.ratio.high <= upper) return Change::same;
  if (c.p > 1 - options.confidence) return Change::unclear;
  if (c.ratio.ratio > upper) return Change::slower;
  return c.ratio.ratio < lower ? Change::faster : Change::unclear;
}

void check_power(std::size_t most_samples, const CompareOptions& options, Comparison& comparison) {
  const double least_alpha = (1 - options.confidence) / static_cast<double>(comparison.matched);
  comparison.has_power = least_p(most_samples, most_samples) <= least_alpha;
  if (comparison.has_power) return;
  std::size_t needed = most_samples;
  while (least_p(needed, needed) > least_alpha) ++needed;
  comparison.warnings.push_back(
      fmt::format("{} samples a case are too few for any of {} cases to be faster or slower beyond doubt; {} would do",
                  most_samples, comparison.matched, needed));
}

void compare_times(const Run& base, const Run& now, std::span<const Match> matches, const CompareOptions& options,
                   Comparison& comparison) {
  const CaseTimes before(base);
  const CaseTimes after(now);
  std::set<std::string> backends;
  for (const Match& match : matches) backends.insert(match.base->backend);
  std::set<std::string> with_control;
  for (const std::string& backend : backends) {
    const std::vector<Sample>* old_control = before.find(control_case_id(backend));
    const std::vector<Sample>* new_control = after.find(control_case_id(backend));
    if (old_control != nullptr && new_control != nullptr) {
      with_control.insert(backend);
      comparison.control_ratio.emplace_back(backend, median(raw_times(*new_control)) / median(raw_times(*old_control)));
    } else if (options.metric == "frame_time") {
      comparison.warnings.push_back(
          fmt::format("no control samples of {} in both runs: its times are compared raw, drift included", backend));
    }
  }

  std::vector<double> p_values;
  std::vector<double> ratios;
  std::size_t most_samples = 0;
  for (const Match& match : matches) {
    const bool relative = options.metric == "frame_time" && with_control.contains(match.base->backend);
    const std::vector<double> old_times = before.of(*match.base, relative);
    const std::vector<double> new_times = after.of(*match.now, relative);
    comparison.cases.push_back(
        {.case_id = match.base->case_id, .ratio = ratio_interval(old_times, new_times, options.confidence)});
    p_values.push_back(mann_whitney_p(old_times, new_times));
    ratios.push_back(comparison.cases.back().ratio.ratio);
    most_samples = std::max(most_samples, std::min(old_times.size(), new_times.size()));
  }
  const std::vector<double> corrected = holm(p_values);
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    comparison.cases[i].p = corrected[i];
    comparison.cases[i].change = judge(comparison.cases[i], options);
  }
  std::stable_sort(comparison.cases.begin(), comparison.cases.end(),
                   [](const CaseChange& a, const CaseChange& b) { return a.ratio.ratio > b.ratio.ratio; });
  comparison.geometric_mean = geometric_mean(ratios);
  check_power(most_samples, options, comparison);
}

nlohmann::json or_null(std::optional<double> value) { return value ? nlohmann::json(*value) : nlohmann::json(); }

}  // namespace

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
  const std::vector<Match> matches = match_cases(base, now, comparison);
  compare_errors(matches, of_time ? "" : options.metric, comparison);
  if (of_time && !matches.empty()) compare_times(base, now, matches, options, comparison);
  return comparison;
}

Exit exit_of(const Comparison& comparison) {
  const auto has = [&](Change change) {
    return std::any_of(comparison.cases.begin(), comparison.cases.end(),
                       [&](const CaseChange& c) { return c.change == change; });
  };
  const bool worse_error = std::any_of(comparison.errors.begin(), comparison.errors.end(),
                                       [](const ErrorChange& error) { return error.worse; });
  if (has(Change::slower) || worse_error || !comparison.lost.empty()) return Exit::answer_is_no;
  if (comparison.matched == 0) return Exit::nothing_measured;
  return has(Change::unclear) && !comparison.has_power ? Exit::inconclusive : Exit::done;
}

nlohmann::json comparison_json(const Comparison& comparison) {
  nlohmann::json cases = nlohmann::json::array();
  for (const CaseChange& c : comparison.cases) {
    cases.push_back({{"case", c.case_id},
                     {"ratio", c.ratio.ratio},
                     {"ci", {c.ratio.low, c.ratio.high}},
                     {"p", c.p},
                     {"change", change_id(c.change)}});
  }
  nlohmann::json errors = nlohmann::json::array();
  for (const ErrorChange& e : comparison.errors) {
    errors.push_back({{"case", e.case_id},
                      {"metric", e.metric},
                      {"base", or_null(e.base)},
                      {"new", or_null(e.now)},
                      {"change", e.worse ? "worse" : "better"}});
  }
  nlohmann::json control = nlohmann::json::object();
  for (const auto& [backend, ratio] : comparison.control_ratio) control[backend] = ratio;
  return {{"schema", kSchemaVersion},
          {"metric", comparison.metric},
          {"matched", comparison.matched},
          {"geometric_mean", comparison.geometric_mean},
          {"control_ratio", std::move(control)},
          {"has_power", comparison.has_power},
          {"cases", std::move(cases)},
          {"errors", std::move(errors)},
          {"lost", comparison.lost},
          {"only_base", comparison.only_base},
          {"only_new", comparison.only_new},
          {"warnings", comparison.warnings}};
}

}  // namespace reliefbench
