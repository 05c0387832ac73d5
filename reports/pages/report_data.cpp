#include "reports/pages/report_data.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/judge/heat_map.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"
#include "reports/pages/data_uri.h"
#include "reports/pages/fleet_data.h"
#include "tuner/decide/choose.h"
#include "tuner/decide/effects.h"
#include "tuner/decide/presets.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/budgets.h"
#include "tuner/results/case_table.h"
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
  json rows = json::array();
  for (const Budget& budget : budgets)
    rows.push_back({{"metric", budget.metric}, {"limit", budget.limit}, {"text", budget.text()}});
  return rows;
}

json metrics_json() {
  json rows = json::array();
  for (const MetricRow& row : metrics())
    rows.push_back({{"id", row.id},
                    {"unit", row.unit},
                    {"lower_is_better", row.lower_is_better},
                    {"none_is_best", row.none_is_best()},
                    {"is_column", row.is_column()},
                    {"is_seen", row.id == kSeenMetric},
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

json legend_json(const HeatMapLegend& legend) {
  json stops = json::array();
  for (const HeatMapStop& stop : legend.stops) stops.push_back({{"value", stop.value}, {"color", stop.color}});
  json marks = json::array();
  for (const HeatMapMark& mark : legend.marks)
    marks.push_back({{"description", mark.description}, {"color", mark.color}});
  return {{"stops", stops}, {"marks", marks}};
}

/// Scenes by id and key; where one id means several scenes, all but the first say which.
class SceneTable {
 public:
  void know(std::span<const MeasuredScene> scenes) {
    for (const MeasuredScene& scene : scenes) known_.try_emplace(scene.key, &scene);
  }
  std::size_t index(const std::string& id, const SceneKey& key) {
    const auto [at, added] = indices_.try_emplace({id, key}, rows_.size());
    if (added) rows_.push_back(row(id, key));
    return at->second;
  }
  [[nodiscard]] const json& rows() const { return rows_; }

 private:
  [[nodiscard]] json row(const std::string& id, const SceneKey& key) const {
    const bool is_new = std::ranges::none_of(
        indices_, [&](const auto& one) { return one.first.first == id && one.first.second != key; });
    json made = {{"id", is_new ? id : fmt::format("{} ({})", id, key.short_text())},
                 {"frame_px", nullptr},
                 {"texel_px", nullptr}};
    const auto scene = known_.find(key);
    if (scene == known_.end()) return made;
    const MeasuredScene& known = *scene->second;
    made["frame_px"] = {known.spec.scene.width_px, known.spec.scene.height_px};
    if (known.map_width > 0) made["texel_px"] = texel_px(known.spec.scene, known.map_width, known.map_height);
    return made;
  }

  std::map<SceneKey, const MeasuredScene*> known_;
  std::map<std::pair<std::string, SceneKey>, std::size_t> indices_;
  json rows_ = json::array();
};

/// Settings by technique and parameters.
class SettingTable {
 public:
  std::size_t index(const Record& record, std::size_t technique) {
    std::string text = record.technique;
    for (const auto& [name, value] : record.params) text += fmt::format(" {}={}", name, value);
    const auto [at, added] = indices_.try_emplace(text, rows_.size());
    if (added) rows_.push_back(row(record, technique, text));
    return at->second;
  }
  [[nodiscard]] const json& rows() const { return rows_; }

 private:
  static json row(const Record& record, std::size_t technique, const std::string& text) {
    json made = {{"technique", technique}, {"params", record.params}, {"map", record.map}};
    try {
      const Settings settings = settings_of(record);
      made.update({{"key", setting_key(settings)},
                   {"name", short_name(settings)},
                   {"features", simplicity(settings).features}});
    } catch (const Error&) {  // a run of another version may have techniques that this one does not know
      made.update({{"key", nullptr}, {"name", text}, {"features", record.params.size()}});
    }
    return made;
  }

  std::unordered_map<std::string, std::size_t> indices_;
  json rows_ = json::array();
};

/// The pictures of points, read together in the end: frames are encoded anew.
class PictureTable {
 public:
  /// Null where the folder has none.
  json pictures_of(const std::filesystem::path& folder, const Record& record) {
    const std::string reference = reference_image_key(record.scene, record.backend, record.case_id);
    json pictures = {{"frame", index(folder, image_path(record.case_id, "frame"), true)},
                     {"reference", index(folder, image_path(reference, "frame"), true)},
                     {"error", index(folder, image_path(record.case_id, "error"), false)},
                     {"taps", index(folder, image_path(record.case_id, "taps"), false)}};
    const bool has_own = !pictures["frame"].is_null() || !pictures["error"].is_null();
    return has_own ? pictures : json();
  }
  [[nodiscard]] std::vector<std::string> data_uris() const {
    std::vector<std::string> uris(files_.size());
    parallel_for(static_cast<int>(files_.size()), 0, [&](int i) {
      const auto& [folder, picture, is_photo] = files_[static_cast<std::size_t>(i)];
      // What is no file of the folder was asked for nowhere, or is a link to the outside: nothing to see.
      uris[static_cast<std::size_t>(i)] =
          (is_photo ? photo_data_uri(folder, picture) : png_data_uri(folder, picture)).value_or("");
    });
    return uris;
  }

 private:
  struct File {
    std::filesystem::path folder;
    std::filesystem::path picture;
    bool is_photo;
  };
  json index(const std::filesystem::path& folder, const std::filesystem::path& picture, bool is_photo) {
    std::error_code unreadable;
    if (!std::filesystem::is_regular_file(folder / picture, unreadable)) return {};
    const auto [at, added] = indices_.try_emplace(folder / picture, files_.size());
    if (added) files_.push_back({.folder = folder, .picture = picture, .is_photo = is_photo});
    return at->second;
  }

  std::map<std::filesystem::path, std::size_t> indices_;
  std::vector<File> files_;
};

json interval_json(const Summary& summary) { return {summary.median, summary.ci_low, summary.ci_high}; }

/// None where a run of another version has settings that this one does not know.
std::vector<AxisEffect> effects_of(std::span<const Record> records) {
  try {
    return axis_effects(records);
  } catch (const Error&) {
    return {};
  }
}

class DataBuilder {
 public:
  ReportData build(std::span<const Run> runs) {
    for (const Technique& technique : techniques()) techniques_.index(std::string(technique.id));
    for (const Run& run : runs) scenes_.know(run.scenes);
    for (std::size_t i = 0; i < runs.size(); ++i) add_run(i, runs[i]);
    return {.data = {{"metrics", metrics_json()},
                     {"techniques", techniques_json()},
                     {"scenes", scenes_.rows()},
                     {"groups", groups_json(runs)},
                     {"settings", settings_.rows()},
                     {"points", std::move(points_)},
                     {"effects", std::move(effects_)},
                     {"fleet", fleet_of(runs)},
                     {"heat_map", legend_json(heat_map_legend())},
                     {"taps_map", legend_json(taps_map_legend())},
                     {"runs", std::move(runs_)},
                     {"front_metric", front_metric_}},
            .images = pictures_.data_uris()};
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
      add_point(index, run, record, mark);
    }
    for (const AxisEffect& effect : effects_of(run.records)) add_effect(index, effect);

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

  void add_point(std::size_t index, const Run& run, const Record& record, std::string_view mark) {
    json errors = json::array();
    for (const MetricRow& row : metrics()) {
      const std::optional<double> value = metric_value(record, row.id);
      errors.push_back(value ? json(*value) : json());
    }
    const Summary& time = record.frame_time->summary;
    const std::size_t scene = scenes_.index(record.scene, record.scene_key);
    const std::size_t setting = settings_.index(record, techniques_.index(record.technique));
    json point = {{"group", group_index(index, record.backend, record.device)},
                  {"scene", scene},
                  {"setting", setting},
                  {"id", record.case_id},
                  {"mark", mark},
                  {"time_ns", interval_json(time)},
                  {"samples", time.n},
                  {"coverage", coverage_text(time.n)},
                  {"timer", record.frame_time->timer},
                  {"errors", std::move(errors)},
                  {"memory_bytes", record.memory_bytes},
                  {"bake_ns", record.bake_time_ns},
                  {"device_bake_ns", record.device_bake_ns ? json(*record.device_bake_ns) : json()},
                  {"first_draw_ns", record.first_draw_ns ? json(*record.first_draw_ns) : json()}};
    if (const std::optional<double> per_px = ns_per_px(run, record)) point["ns_per_px"] = *per_px;
    if (!pictured_.contains({scene, setting})) {
      json pictures = pictures_.pictures_of(run.folder, record);
      if (!pictures.is_null()) {
        pictured_.insert({scene, setting});
        point["pictures"] = std::move(pictures);
      }
    }
    points_.push_back(std::move(point));
  }

  void add_effect(std::size_t run, const AxisEffect& effect) {
    json errors = json::array();
    for (const auto& error : effect.errors) errors.push_back(error ? interval_json(*error) : json());
    effects_.push_back({{"group", group_index(run, effect.backend, effect.device)},
                        {"axis", effect.axis},
                        {"prices_feature", effect.prices_feature},
                        {"from", effect.from},
                        {"to", effect.to},
                        {"pairs", effect.pairs},
                        {"coverage", coverage_text(static_cast<int>(effect.pairs))},
                        {"time", interval_json(effect.time)},
                        {"errors", std::move(errors)}});
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
  SettingTable settings_;
  PictureTable pictures_;
  std::set<std::pair<std::size_t, std::size_t>> pictured_;  ///< (scene, setting)
  json points_ = json::array();
  json effects_ = json::array();
  json runs_ = json::array();
  std::string front_metric_;
};

}  // namespace

json setting_name_json(std::string_view id) {
  const Settings settings = parse_setting(id);
  return {{"name", short_name(settings)}, {"key", setting_key(settings)}};
}

ReportData empty_report_data() { return DataBuilder().build({}); }

ReportData report_data(std::span<const Run> runs) {
  if (std::all_of(runs.begin(), runs.end(), [](const Run& run) { return run.records.empty(); }))
    throw Error(Exit::nothing_measured, "report: the runs have no records yet");
  return DataBuilder().build(runs);
}

}  // namespace reliefbench
