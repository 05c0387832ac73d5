#include "tuner/history/export.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <set>

#include "tuner/history/moment.h"
#include "tuner/plan/scene_key.h"
#include "tuner/results/csv.h"

namespace reliefbench {
namespace {

using nlohmann::json;

constexpr double kNormal95 = 1.959964;
constexpr double kSigmaOfMad = 1.4826;

bool is_of_ours(const SeriesRow& series) { return series.metric == "frame_time"; }

/// What a view's series are called outside: the case's id, of a benchmark its name. Series of one name (a changed
/// heightmap's, another device's) have what tells them apart behind it.
class ExportedNames {
 public:
  explicit ExportedNames(const HistoryView& view) {
    for (const SeriesRow& series : view.series) {
      Namesakes& namesakes = namesakes_[{series.machine, series.case_id}];
      namesakes.scene_keys.insert(series.scene_key);
      namesakes.devices.insert(series.device);
    }
  }

  [[nodiscard]] std::string of(const SeriesRow& series) const {
    const Namesakes& namesakes = namesakes_.at({series.machine, series.case_id});
    std::string name = series.case_id;
    if (namesakes.scene_keys.size() > 1) name += fmt::format(" [{}]", short_key(series.scene_key));
    if (namesakes.devices.size() > 1) name += fmt::format(" [{}]", series.device);
    return name;
  }

 private:
  struct Namesakes {
    std::set<std::string> scene_keys;
    std::set<std::string> devices;
  };
  std::map<std::pair<std::string, std::string>, Namesakes> namesakes_;  ///< by machine and case
};

/// Calls `use` with each series of a view of one run and its row there.
template <typename Use>
void each_result(const HistoryView& view, const Use& use) {
  for (std::size_t i = 0; i < view.series.size(); ++i)
    for (const RepetitionRow& row : view.nights[i]) use(view.series[i], row);
}

/// The series of one benchmark, which Google Benchmark's JSON has in one entry.
struct ExportedCase {
  std::vector<std::pair<const SeriesRow*, const RepetitionRow*>> numbers;
};

/// Cases in the order of their first series.
std::vector<std::pair<std::string, ExportedCase>> cases_of(const HistoryView& view) {
  std::vector<std::pair<std::string, ExportedCase>> cases;
  std::map<std::string, std::size_t> places;
  const ExportedNames names(view);
  each_result(view, [&](const SeriesRow& series, const RepetitionRow& row) {
    const auto [place, is_new] = places.try_emplace(names.of(series), cases.size());
    if (is_new) cases.emplace_back(place->first, ExportedCase());
    cases[place->second].second.numbers.emplace_back(&series, &row);
  });
  return cases;
}

/// Puts a number of a case into an entry of its.
void put_number(json& entry, const SeriesRow& series, double number) {
  if (!is_of_ours(series)) {
    entry[series.metric] = number;
  } else {
    entry["real_time"] = entry["cpu_time"] = number;
  }
}

json entry_of(const std::string& name, std::size_t repetitions, std::size_t index) {
  return {{"name", name},
          {"run_name", name},
          {"run_type", "iteration"},
          {"repetitions", repetitions},
          {"repetition_index", index},
          {"threads", 1},
          {"iterations", 1},
          {"time_unit", "ns"}};
}

void add_entries(const std::string& name, const ExportedCase& exported, json& entries) {
  std::size_t repetitions = 0;
  int aggregated = 0;
  std::string trouble;
  for (const auto& [series, row] : exported.numbers) {
    repetitions = std::max(repetitions, row->samples.size());
    if (row->samples.empty()) aggregated = std::max(aggregated, row->n);
    if (row->status != "ok" && row->status != "not_finite") trouble = row->status;
  }
  if (!trouble.empty()) {
    entries.push_back(entry_of(name, 1, 0));
    entries.back().update(
        {{"error_occurred", true}, {"error_message", trouble}, {"real_time", 0.0}, {"cpu_time", 0.0}});
    return;
  }
  for (std::size_t i = 0; i < repetitions; ++i) {
    json& entry = entries.emplace_back(entry_of(name, repetitions, i));
    for (const auto& [series, row] : exported.numbers) {
      if (i < row->samples.size()) put_number(entry, *series, row->samples[i]);
      if (is_of_ours(*series) && row->is_valid) entry["relative_time"] = row->value;
    }
  }
  if (aggregated == 0) return;
  for (const std::string aggregate : {"median", "stddev"}) {
    json& entry = entries.emplace_back(entry_of(fmt::format("{}_{}", name, aggregate), 0, 0));
    entry.erase("repetition_index");
    entry.update({{"run_name", name},
                  {"run_type", "aggregate"},
                  {"aggregate_name", aggregate},
                  {"aggregate_unit", "time"},
                  {"repetitions", aggregated}});
    for (const auto& [series, row] : exported.numbers)
      if (row->samples.empty() && row->n > 0)
        put_number(entry, *series, aggregate == "median" ? row->median : kSigmaOfMad * row->mad);
  }
}

json context_of(const HistoryView& view) {
  json context = {{"library_build_type", "release"}};
  if (view.runs.empty()) return context;
  const RunRow& run = view.runs.front();
  for (const EnvironmentRow& environment : view.environments)
    if (run.kind == "google-benchmark")
      context = environment.content;
    else
      context["environment"] = environment.content;
  context.update({{"date", moment_text(run.unix_s)},
                  {"host_name", run.machine},
                  {"commit", commit_text(run.build)},
                  {"parent", run.build.parent}});
  return context;
}

/// A number with its interval of 95 %.
json bounded(double value, double standard_error) {
  json measure = {{"value", value}};
  if (standard_error > 0) {
    measure["lower_value"] = value * std::exp(-kNormal95 * standard_error);
    measure["upper_value"] = value * std::exp(kNormal95 * standard_error);
  }
  return measure;
}

std::string column_name(const ExportedNames& names, const SeriesRow& series) {
  return is_of_ours(series) ? names.of(series) : fmt::format("{} {}", names.of(series), series.metric);
}

}  // namespace

json google_benchmark_json(const HistoryView& view) {
  json entries = json::array();
  for (const auto& [name, exported] : cases_of(view)) add_entries(name, exported, entries);
  return {{"context", context_of(view)}, {"benchmarks", entries}};
}

json bencher_json(const HistoryView& view) {
  json results = json::object();
  const ExportedNames names(view);
  each_result(view, [&](const SeriesRow& series, const RepetitionRow& row) {
    if (!row.is_valid) return;
    json& measures = results[names.of(series)];
    if (is_of_ours(series)) measures["relative-time"] = bounded(row.value, row.standard_error);
    const bool is_time = is_of_ours(series) || series.metric == "real_time";
    measures[is_time ? "latency" : series.metric] = bounded(row.median, row.standard_error);
  });
  return results;
}

json github_action_json(const HistoryView& view) {
  json list = json::array();
  const ExportedNames names(view);
  each_result(view, [&](const SeriesRow& series, const RepetitionRow& row) {
    if (!row.is_valid || !series.lower_is_better) return;
    list.push_back({{"name", column_name(names, series)},
                    {"unit", is_of_ours(series) ? "of the control case" : series.unit},
                    {"value", row.value},
                    {"extra", fmt::format("median {:.6g} {}, {} samples", row.median, series.unit, row.n)}});
    if (row.standard_error > 0) list.back()["range"] = fmt::format("± {:.2g} %", 100 * kNormal95 * row.standard_error);
  });
  return list;
}

std::string otava_csv(const HistoryView& view) {
  bool with_machine = false;
  for (const RunRow& run : view.runs) with_machine |= run.machine != view.runs.front().machine;
  const ExportedNames names(view);
  std::vector<std::string> header = {"time", "commit"};
  std::map<std::int64_t, std::vector<std::string>> lines;
  for (const RunRow& run : view.runs) {
    std::vector<std::string>& line = lines[run.id];
    line.resize(2 + view.series.size());
    line[0] = moment_text(run.unix_s);
    line[1] = commit_text(run.build);
  }
  for (std::size_t i = 0; i < view.series.size(); ++i) {
    const std::string name = column_name(names, view.series[i]);
    header.push_back(with_machine ? fmt::format("{} {}", view.series[i].machine, name) : name);
    for (const RepetitionRow& row : view.nights[i])
      if (row.is_valid) lines.at(row.run)[2 + i] = fmt::format("{}", row.value);
  }
  std::string text = csv_line(header);
  for (const RunRow& run : view.runs) text += csv_line(lines.at(run.id));
  return text;
}

}  // namespace reliefbench
