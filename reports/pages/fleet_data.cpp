#include "reports/pages/fleet_data.h"

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "kernels/base/error.h"
#include "tuner/decide/fleet.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/run_question.h"

namespace reliefbench {

using nlohmann::json;

json fleet_page_data(json told) {
  if (!told.contains("settings")) return told;
  json& settings = told["settings"];
  told["common_settings"] = settings.size();
  if (settings.size() > kFleetSettings) settings.erase(settings.begin() + kFleetSettings, settings.end());
  for (json& one : settings) one["name"] = short_name(parse_setting(one["setting"].get<std::string>()));
  for (json& place : told["places"]) {
    const Settings best = parse_setting(place["best"].get<std::string>());
    place["name"] = short_name(best);
    place["key"] = setting_key(best);
  }
  return told;
}

json fleet_of(std::span<const Run> runs) {
  std::set<std::tuple<std::string, std::string, std::string>> places;
  for (const Run& run : runs)
    for (const Record& record : run.records)
      if (record.status == Status::ok) places.insert({record.backend, record.device, record.scene});
  if (places.size() < 2) return {};
  try {
    const FleetOptions options{.budgets = question_of(runs.front()).budgets};
    std::vector<FleetRun> fleet_runs;
    for (const Run& run : runs) fleet_runs.push_back(fleet_run(run));
    const Fleet fleet = choose_for_fleet(fleet_runs, options);
    return fleet_page_data(fleet_json(fleet, fleet_runs, options));
  } catch (const Error& error) {
    return {{"refusal", error.what()}};
  }
}

}  // namespace reliefbench
