#include "reports/pages/report_data.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "kernels/base/error.h"
#include "kernels/judge/heat_map.h"
#include "kernels/trace/technique.h"
#include "reports/pages/data_uri.h"
#include "tuner/decide/pareto.h"
#include "tuner/decide/recommend.h"
#include "tuner/results/coarse_filter.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// The names that points refer to by index, in the order in which they were first seen.
class NameTable {
 public:
  std::size_t index(const std::string& name) {
    const auto [at, added] = indices_.try_emplace(name, names_.size());
    if (added) names_.push_back(name);
    return at->second;
  }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

 private:
  std::unordered_map<std::string, std::size_t> indices_;
  std::vector<std::string> names_;
};

struct Group {
  std::size_t run = 0;
  std::string backend;
  std::string device;
};

json budgets_json(std::span<const Budget> budgets) {
  json texts = json::array();
  for (const Budget& budget : budgets) texts.push_back({{"metric", budget.metric}, {"text", budget.text()}});
  return texts;
}

json metrics_json() {
  json rows = json::array();
  for (const MetricRow& row : metrics())
    rows.push_back({{"id", row.id},
                    {"unit", row.unit},
                    {"lower_is_better", row.lower_is_better},
                    {"none_is_best", row.none_is_best()},
                    {"is_column", row.is_column()},
                    {"description", row.description}});
  return rows;
}

// How the cases of a run ended: a row a (status, backend, reason), the most frequent first within a status.
json statuses_json(std::span<const Record> records) {
  struct Ended {
    int count = 0;
    std::string example;
  };
  std::map<std::tuple<Status, std::string, std::string>, Ended> table;
  for (const Record& record : records) {
    Ended& ended = table[{record.status, record.backend, record.reason}];
    if (ended.count++ == 0) ended.example = record.case_id;
  }
  json rows = json::array();
  for (const auto& [key, ended] : table)
    rows.push_back({{"status", status_id(std::get<0>(key))},
                    {"backend", std::get<1>(key)},
                    {"reason", std::get<2>(key)},
                    {"count", ended.count},
                    {"example", ended.example}});
  std::stable_sort(rows.begin(), rows.end(), [](const json& a, const json& b) {
    return a["status"] == b["status"] && a["count"].get<int>() > b["count"].get<int>();
  });
  return rows;
}

// fronts() is of errors. A quality is an error with its sign turned.
std::vector<Front> quality_fronts(std::span<const Record> records, const MetricRow& metric,
                                  std::span<const Budget> constraints) {
  std::vector<Front> result;
  for (const RecordGroup& group : group_records(records)) {
    Front front{.backend = group.backend,
                .device = group.device,
                .scene = group.scene,
                .scene_key = group.scene_key,
                .error_metric = std::string(metric.id),
                .constraints = {},
                .points = {}};
    std::vector<FrontPoint> eligible;
    std::vector<double> times;
    std::vector<double> errors;
    for (const Record* record : group.records) {
      const auto met = [&](const Budget& budget) { return meets(*record, budget); };
      if (!record->frame_time || !record->error || !std::all_of(constraints.begin(), constraints.end(), met)) continue;
      constexpr double kInfinity = std::numeric_limits<double>::infinity();
      const double quality = metric_value(*record, metric.id).value_or(metric.none_is_best() ? kInfinity : -kInfinity);
      times.push_back(record->frame_time->summary.median);
      errors.push_back(-quality);
      eligible.push_back({.record = record, .time_ns = times.back(), .error = errors.back(), .equivalents = {}});
    }
    for (const std::size_t i : pareto_front(times, errors)) front.points.push_back(eligible[i]);
    result.push_back(std::move(front));
  }
  return result;
}

/// Scenes by id and key; where one id means several scenes, all but the first say which.
class SceneTable {
 public:
  std::size_t index(const std::string& id, const SceneKey& key) {
    const auto [at, added] = indices_.try_emplace({id, key}, names_.size());
    if (added)
      names_.push_back(std::ranges::find(names_, id) == names_.end() ? id
                                                                     : fmt::format("{} ({})", id, key.short_text()));
    return at->second;
  }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

 private:
  std::map<std::pair<std::string, SceneKey>, std::size_t> indices_;
  std::vector<std::string> names_;
};

class DataBuilder {
 public:
  json build(std::span<const Run> runs) {
    for (const Technique& technique : techniques()) techniques_.index(std::string(technique.id));
    for (std::size_t i = 0; i < runs.size(); ++i) add_run(i, runs[i]);
    return {{"metrics", metrics_json()},    {"techniques", techniques_json()},
            {"scenes", scenes_.names()},    {"groups", groups_json(runs)},
            {"points", std::move(points_)}, {"fronts", std::move(fronts_)},
            {"answers", answers_},          {"images", images_},
            {"heat_map", heat_map_json()},  {"runs", runs_},
            {"front_metric", front_metric_}};
  }

 private:
  void add_run(std::size_t index, const Run& run) {
    const auto [metric, constraints, budgets] = question_of(run);
    if (index == 0) front_metric_ = find_metric(metric).id;

    std::map<std::string, CoarseFilter> filters;  // by backend
    std::set<std::string> filter_notes;
    for (const Record& record : run.records) {
      if (record.status != Status::ok || !record.frame_time || !record.error) continue;
      const CoarseFilter& filter = filters.try_emplace(record.backend, run.info, record.backend).first->second;
      const std::string_view mark = filter.mark(record.case_id);
      if (!mark.empty()) filter_notes.insert(filter.note());
      add_point(index, record, constraints);
      points_.back()["mark"] = mark;
    }
    for (std::size_t i = 0; i < metrics().size(); ++i) {
      const MetricRow& row = metrics()[i];
      if (index == 0) fronts_.push_back({{"metric", row.id}, {"fronts", json::array()}});
      for (const Front& f : row.lower_is_better ? fronts(run.records, row.id, constraints)
                                                : quality_fronts(run.records, row, constraints))
        fronts_[i]["fronts"].push_back(front_json(index, f));
    }
    const Question question{.budgets = budgets, .max_time_ms = {}, .error_metric = metric};
    for (const Answer& answer : recommend(run.records, question))
      answers_.push_back(answer_json(index, run.folder, answer));

    json info = run.info;
    info.erase("config");  // long, and it lies beside the page in run.json
    runs_.push_back({{"folder", run.folder.string()},
                     {"info", info},
                     {"budgets", budgets_json(budgets)},
                     {"constraints", budgets_json(constraints)},
                     {"filter_notes", filter_notes},
                     {"statuses", statuses_json(run.records)}});
  }

  std::size_t group_index(std::size_t run, const std::string& backend, const std::string& device) {
    const auto at = std::find_if(groups_.begin(), groups_.end(), [&](const Group& g) {
      return g.run == run && g.backend == backend && g.device == device;
    });
    if (at != groups_.end()) return static_cast<std::size_t>(at - groups_.begin());
    groups_.push_back({.run = run, .backend = backend, .device = device});
    return groups_.size() - 1;
  }

  void add_point(std::size_t run, const Record& record, std::span<const Budget> constraints) {
    point_of_[&record] = points_.size();
    json errors = json::array();
    for (const MetricRow& row : metrics()) {
      const std::optional<double> value = metric_value(record, row.id);
      errors.push_back(value ? json(*value) : json());
    }
    json breaks = json::array();
    for (const Budget& constraint : constraints)
      if (!meets(record, constraint)) breaks.push_back(constraint.text());
    const Summary& time = record.frame_time->summary;
    points_.push_back({{"group", group_index(run, record.backend, record.device)},
                       {"scene", scenes_.index(record.scene, record.scene_key)},
                       {"technique", techniques_.index(record.technique)},
                       {"id", record.case_id},
                       {"params", record.params},
                       {"time_ns", {time.median, time.ci_low, time.ci_high}},
                       {"samples", time.n},
                       {"coverage", coverage_text(time.n)},
                       {"timer", record.frame_time->timer},
                       {"errors", std::move(errors)},
                       {"breaks", std::move(breaks)},
                       {"memory_bytes", record.memory_bytes},
                       {"bake_ns", record.bake_time_ns},
                       {"first_draw_ns", record.first_draw_ns}});
  }

  [[nodiscard]] json point_json(const Record* record) const {
    const auto at = point_of_.find(record);
    return at == point_of_.end() ? json() : json(at->second);
  }

  json front_json(std::size_t run, const Front& front) {
    json points = json::array();
    for (const FrontPoint& point : front.points) {
      json equivalents = json::array();
      for (const Record* record : point.equivalents) equivalents.push_back(point_json(record));
      points.push_back({{"point", point_json(point.record)}, {"equivalents", equivalents}});
    }
    return {{"group", group_index(run, front.backend, front.device)},
            {"scene", scenes_.index(front.scene, front.scene_key)},
            {"points", points}};
  }

  json answer_json(std::size_t run, const std::filesystem::path& folder, const Answer& answer) {
    json pictures;
    if (answer.pick != nullptr)
      pictures = {
          {"frame", image_index(folder, image_path(answer.pick->case_id, "frame"))},
          {"reference",
           image_index(folder,
                       image_path(reference_image_key(answer.scene, answer.backend, answer.pick->case_id), "frame"))},
          {"error", image_index(folder, image_path(answer.pick->case_id, "error"))}};
    return {{"group", group_index(run, answer.backend, answer.device)},
            {"scene", scenes_.index(answer.scene, answer.scene_key)},
            {"pick", point_json(answer.pick)},
            {"tie", point_json(answer.tie)},
            {"runner_up", point_json(answer.runner_up)},
            {"simplest", point_json(answer.simplest)},
            {"flat", point_json(answer.flat)},
            {"nearest", point_json(answer.nearest)},
            {"miss", answer.miss},
            {"pictures", pictures}};
  }

  json image_index(const std::filesystem::path& folder, const std::filesystem::path& picture) {
    const std::filesystem::path path = folder / picture;
    const auto known = image_of_.find(path);
    if (known != image_of_.end()) return known->second;
    const std::optional<std::string> uri = png_data_uri(folder, picture);
    if (!uri) return image_of_[path] = json();
    images_.push_back(*uri);
    return image_of_[path] = images_.size() - 1;
  }

  [[nodiscard]] json techniques_json() const {
    json rows = json::array();
    for (const std::string& id : techniques_.names()) {
      const auto known = std::find_if(techniques().begin(), techniques().end(),
                                      [&](const Technique& technique) { return technique.id == id; });
      // A run of another version may have techniques that this one does not know.
      rows.push_back({{"id", id}, {"description", known == techniques().end() ? "" : known->description}});
    }
    return rows;
  }

  // A device goes by its name; where two groups would have one label, the run's name (or folder) tells them apart.
  [[nodiscard]] json groups_json(std::span<const Run> runs) const {
    json rows = json::array();
    for (const Group& group : groups_) {
      std::string label = fmt::format("{} ({})", group.device, group.backend);
      const auto twins = std::count_if(groups_.begin(), groups_.end(), [&](const Group& g) {
        return g.backend == group.backend && g.device == group.device;
      });
      if (twins > 1) label += fmt::format(", {}", runs[group.run].folder.string());
      rows.push_back({{"run", group.run}, {"backend", group.backend}, {"device", group.device}, {"label", label}});
    }
    return rows;
  }

  SceneTable scenes_;
  NameTable techniques_;
  std::vector<Group> groups_;
  std::unordered_map<const Record*, std::size_t> point_of_;
  std::map<std::filesystem::path, json> image_of_;
  json points_ = json::array();
  json fronts_ = json::array();
  json answers_ = json::array();
  json images_ = json::array();
  json runs_ = json::array();
  std::string front_metric_;
};

}  // namespace

json heat_map_json() {
  const HeatMapLegend legend = heat_map_legend();
  json stops = json::array();
  for (const HeatMapStop& stop : legend.stops) stops.push_back({{"e_xy", stop.e_xy}, {"color", stop.color}});
  json marks = json::array();
  for (const HeatMapMark& mark : legend.marks)
    marks.push_back({{"description", mark.description}, {"color", mark.color}});
  return {{"stops", stops}, {"marks", marks}};
}

json report_data(std::span<const Run> runs) {
  if (std::all_of(runs.begin(), runs.end(), [](const Run& run) { return run.records.empty(); }))
    throw Error(Exit::nothing_measured, "report: the runs have no records yet");
  return DataBuilder().build(runs);
}

}  // namespace reliefbench
