#include "reports/pages/tune_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "kernels/base/atomic_file.h"
#include "kernels/judge/score.h"
#include "reports/pages/report_data.h"
#include "reports/pages/template.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// A setting that was timed, as a sweep would have recorded it; of its errors only the one that is searched by.
Record record_of(const TuneResult& result, std::size_t candidate, const std::string& scene) {
  const Candidate& setting = result.space.candidates[candidate];
  const CandidateState& state = result.search.states[candidate];
  const Case c{.settings = parse_setting(setting.id), .scene_id = scene, .backend = result.backend};
  Record record;
  record.case_id = c.id();
  record.technique = c.settings.technique().id;
  for (const SettingValue& given : c.settings.written()) record.params.emplace_back(given.param.id, given.text());
  record.map = map_of(c.settings).id;
  record.scene = scene;
  if (result.scene_keys.size() == 1) record.scene_key = result.scene_keys.front();
  record.backend = result.backend;
  record.device = result.device;
  record.frame_time = FrameTime{.summary = {.median = *state.time_ns,
                                            .ci_low = state.low_ns.value_or(*state.time_ns),
                                            .ci_high = state.high_ns.value_or(*state.time_ns),
                                            .n = state.samples},
                                .raw_median = *state.time_ns,
                                .timer = "the search's estimate"};
  record.error = FrameScore{};
  record.error->values.at(find_metric(result.error_metric).place) = setting.error;
  return record;
}

/// What was timed and is within all budgets but that on the searched error, as a run.
Run run_of(const TuneResult& result, const std::filesystem::path& folder) {
  Run run;
  run.folder = folder;
  const std::string scene = fmt::format("{}", fmt::join(result.scenes, ", "));
  json budgets = json::array();
  for (const Budget& budget : result.question.max_error)
    if (budget.metric == result.error_metric) budgets.push_back(budget.text());
  run.info = {{"name", fmt::format("What to ship in {}", scene)},
              {"finished", true},
              {"front", {{"error", result.error_metric}, {"constraints", json::array()}}},
              {"budgets", budgets}};
  for (std::size_t i = 0; i < result.search.states.size(); ++i) {
    const CandidateState& state = result.search.states[i];
    if (result.space.candidates[i].is_feasible && state.evidence == Evidence::measured && state.time_ns)
      run.records.push_back(record_of(result, i, scene));
  }
  return run;
}

/// Leaves one metric, the only one that the search's settings are known by.
void keep_metric(json& data, const std::string& metric) {
  const std::size_t place = find_metric(metric).place;
  data["metrics"] = {data["metrics"][place]};
  for (const char* list : {"points", "effects"})
    for (json& one : data[list]) one["errors"] = {one["errors"][place]};
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

}  // namespace

ReportData tune_page_data(const TuneResult& result, const std::filesystem::path& folder) {
  const Run run = run_of(result, folder);
  ReportData made = run.records.empty() ? empty_report_data() : report_data({&run, 1});
  if (!run.records.empty()) {
    keep_metric(made.data, result.error_metric);
    const std::string coverage = fmt::format("{:.3g} %", 100 * result.question.confidence);
    for (json& point : made.data["points"]) point["coverage"] = coverage;
  }
  json& tune = made.data["tune"] = tune_json(result);
  tune["pick_point"] = result.pick ? point_of(run, result.pick->setting) : json();
  tune["answer_points"] = json::array();
  for (const BudgetAnswer& answer : result.search.answers)
    tune["answer_points"].push_back(point_of(run, result.space.candidates[answer.pick].id));
  return made;
}

void write_tune_page(const TuneResult& result, const std::filesystem::path& folder) {
  const ReportData made = tune_page_data(result, folder);
  write_atomically(folder / kTunePage, fill_page(kReportFile, made.data, made.images));
}

}  // namespace reliefbench
