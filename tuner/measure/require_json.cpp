#include <algorithm>
#include <nlohmann/json.hpp>

#include "tuner/measure/require_run.h"
#include "tuner/plan/scene_json.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using nlohmann::json;

json set_json(const RequireReport& report, FeatureSet set) {
  const SeenSet& seen = report.at(set);
  return {{"features", report.names(set)},
          {"setting", setting_id(seen.settings)},
          {"value", seen.value},
          {"worst_view", report.file.scenes[seen.view].id}};
}

}  // namespace

json require_json(const RequireReport& report) {
  json rows = json::array();
  for (const TriedRow& row : report.rows)
    rows.push_back(
        {{"feature", row.feature}, {"choice", row.choice}, {"value", row.value}, {"is_chosen", row.is_chosen}});
  json sets = json::array();
  for (const SeenSet& seen : report.seen) sets.push_back(set_json(report, seen.set));
  json ties = json::array();
  for (const FeatureSet set : report.ties) ties.push_back(report.names(set));
  json features = json::array();
  for (const FeatureWorth& worth : report.worth) {
    features.push_back({{"feature", worth.name},
                        {"choice", worth.choice},
                        {"is_needed", worth.is_needed},
                        {"without", set_json(report, worth.without)},
                        {"with", set_json(report, worth.with)}});
    if (worth.price_ns.n > 0) features.back()["price_ns"] = summary_json(worth.price_ns);
  }
  json answer = set_json(report, report.answer);
  if (report.frame_time_ns.n > 0) answer["frame_time_ns"] = summary_json(report.frame_time_ns);
  json held_back = json::object();
  if (!report.ties_held_back.empty()) held_back["ties"] = report.ties_held_back;
  if (!report.times_held_back.empty()) held_back["times"] = report.times_held_back;
  json all = {
      {"schema", kRequireSchema},
      {"scene", report.file.name},
      {"about", report.file.about},
      {"visible", report.file.visible.text()},
      {"is_met", report.is_met},
      {"answer", std::move(answer)},
      {"ties", std::move(ties)},
      {"features", std::move(features)},
      {"rows", std::move(rows)},
      {"search", {{"is_exhaustive", report.is_exhaustive}, {"sets", report.sets}, {"drawn", report.seen.size()}}},
      {"sets", std::move(sets)},
      {"views", scenes_json(report.views)},
      {"device",
       {{"backend", report.backend},
        {"name", report.device},
        {"software", report.is_software},
        {"timer", report.timer}}}};
  for (const FailedSetting& failed : report.failed)
    all["failed"].push_back({{"setting", setting_id(failed.settings)}, {"reason", failed.reason}});
  if (!held_back.empty()) all["held_back"] = std::move(held_back);
  return all;
}

}  // namespace reliefbench
