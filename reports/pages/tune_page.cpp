#include "reports/pages/tune_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/base/json_file.h"
#include "kernels/judge/score.h"
#include "reports/pages/fleet_data.h"
#include "reports/pages/report_data.h"
#include "reports/pages/template.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// A setting that was timed, as a sweep would have recorded it; of its errors only the one that is searched by.
/// state: one of tune.json's settings
Record record_of(const json& tune, const json& state, const std::string& scene) {
  const double time_ns = state.at("time_ns");
  const Case c{.settings = parse_setting(state.at("setting").get<std::string>()),
               .scene_id = scene,
               .backend = tune.at("backend")};
  Record record;
  record.case_id = c.id();
  record.technique = c.settings.technique().id;
  for (const SettingValue& given : c.settings.written()) record.params.emplace_back(given.param.id, given.text());
  record.map = map_of(c.settings).id;
  record.scene = scene;
  if (const json& keys = tune.at("scene_keys"); keys.size() == 1)
    record.scene_key = SceneKey{keys.front().get<std::string>()};
  record.backend = tune.at("backend");
  record.device = tune.at("device");
  const auto bound = [&](const char* key) { return state.at(key).is_null() ? time_ns : state.at(key).get<double>(); };
  record.frame_time = FrameTime{
      .summary = {.median = time_ns, .ci_low = bound("low_ns"), .ci_high = bound("high_ns"), .n = state.at("samples")},
      .raw_median = time_ns,
      .timer = "the search's estimate"};
  record.error = FrameScore{};
  record.error->values.at(find_metric(tune.at("error_metric").get<std::string>()).place) =
      state.at("error").get<double>();
  return record;
}

/// What was timed and is within all budgets but that on the searched error, as a run.
Run run_of(const json& tune, const std::filesystem::path& folder) {
  Run run;
  run.folder = folder;
  const std::string scene = fmt::format("{}", fmt::join(tune.at("scenes").get<std::vector<std::string>>(), ", "));
  const std::string metric = tune.at("error_metric");
  json budgets = json::array();
  for (const json& text : tune.at("question").at("max_error"))
    if (parse_budget(text.get<std::string>()).metric == metric) budgets.push_back(text);
  run.info = {{"name", fmt::format("What to ship in {}", scene)},
              {"finished", true},
              {"front", {{"error", metric}, {"constraints", json::array()}}},
              {"budgets", budgets}};
  for (const json& state : tune.at("settings"))
    if (state.at("feasible") == true && state.value("evidence", "") == "measured" && !state.at("time_ns").is_null())
      run.records.push_back(record_of(tune, state, scene));
  return run;
}

/// Leaves one metric, the only one that the search's settings are known by, and takes out what is not known of them.
void keep_known(json& data, const std::string& metric) {
  const std::size_t place = find_metric(metric).place;
  data["metrics"] = {data["metrics"][place]};
  for (const char* list : {"points", "effects"})
    for (json& one : data[list]) one["errors"] = {one["errors"][place]};
  for (json& point : data["points"])
    for (const char* unknown : {"memory_bytes", "bake_ns", "device_bake_ns", "first_draw_ns"}) point[unknown] = nullptr;
  const auto is_other = [&](const json& budget) { return budget["metric"] != metric; };
  for (json& run : data["runs"]) std::erase_if(run["budgets"].get_ref<json::array_t&>(), is_other);
}

/// The place of a setting among the points; null where it is none of them.
json point_of(const Run& run, const std::string& setting) {
  const Settings settings = parse_setting(setting);
  const auto is_it = [&](const Record& record) { return parse_setting(record.case_id) == settings; };
  const auto found = std::ranges::find_if(run.records, is_it);
  return found == run.records.end() ? json() : json(found - run.records.begin());
}

/// The budgets on other metrics than the searched one, which all that is shown is within, as texts.
json kept_budgets(const json& tune) {
  json kept = json::array();
  const json& asked = tune.at("question").at("max_error");
  for (const json& text : asked.empty() ? tune.at("constraints") : asked)
    if (parse_budget(text.get<std::string>()).metric != tune.at("error_metric")) kept.push_back(text);
  return kept;
}

/// The keys of the settings that a run's folder has records of; none where it has no records that can be read.
std::set<std::string> recorded_keys(const std::filesystem::path& folder) try {
  std::set<std::string> keys;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(folder / kResultsFile, ignored)) return keys;
  for (const Record& record : load_run(folder).records)
    if (record.status == Status::ok) keys.insert(setting_key(parse_setting(record.case_id)));
  return keys;
} catch (const Error&) {
  return {};
}

/// Of each setting the folder whose records have it, which commands take as --run.
void add_recorded(json& settings, const std::filesystem::path& folder) {
  const std::set<std::string> keys = recorded_keys(folder);
  for (json& setting : settings)
    if (keys.contains(setting["key"].get<std::string>())) setting["recorded_in"] = folder.string();
}

/// What the page calls the settings that it tells of, by their ids.
json setting_names(const json& tune) {
  json names = json::object();
  const auto add = [&](const json& told) {
    const std::string id = told.is_string() ? told : told.at("setting");
    if (!id.empty()) names[id] = setting_name_json(id);
  };
  for (const json& setting : tune.at("settings"))
    if (setting.value("evidence", "none") != "none") add(setting);
  for (const char* list : {"rungs", "answers"})
    for (const json& one : tune.at(list)) add(one);
  for (const json& scene : tune.at("scene_answers"))
    if (!scene.at("own").is_null()) add(scene.at("own"));
  if (!tune.at("pick").is_null()) add(tune.at("pick"));
  add(tune.at("nearest"));
  return names;
}

}  // namespace

ReportData tune_page_data(const json& tune, const std::filesystem::path& folder) {
  const Run run = run_of(tune, folder);
  ReportData made = run.records.empty() ? empty_report_data() : report_data({&run, 1});
  if (!run.records.empty()) {
    keep_known(made.data, tune.at("error_metric"));
    const std::filesystem::path replayed = tune.at("replayed").get<std::string>();
    add_recorded(made.data["settings"], replayed.empty() ? folder : replayed);
    const std::string coverage = fmt::format("{:.3g} %", 100 * tune.at("question").at("confidence").get<double>());
    for (json& point : made.data["points"]) point["coverage"] = coverage;
  }
  if (tune.contains("fleet")) made.data["fleet"] = fleet_page_data(tune.at("fleet"));
  json& told = made.data["tune"] = tune;
  told.erase("fleet");  // it stands with the page's other data
  told["kept_budgets"] = kept_budgets(tune);
  told["names"] = setting_names(tune);
  const json& pick = tune.at("pick");
  told["pick_point"] = pick.is_null() ? json() : point_of(run, pick.at("setting").get<std::string>());
  told["answer_points"] = json::array();
  for (const json& answer : tune.at("answers"))
    told["answer_points"].push_back(point_of(run, answer.at("setting").get<std::string>()));
  return made;
}

bool is_tune_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(folder / kTuneFile, ignored);
}

json load_tune(const std::filesystem::path& folder) { return read_json(folder / kTuneFile); }

void write_tune_page(const TuneResult& result, const std::filesystem::path& folder) {
  const ReportData made = tune_page_data(tune_json(result), folder);
  write_atomically(folder / kTunePage, fill_page(kReportFile, made.data, made.images));
}

}  // namespace reliefbench
