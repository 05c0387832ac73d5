#include <nlohmann/json.hpp>

#include "tuner/measure/stress.h"

namespace reliefbench {
namespace {

using nlohmann::json;

json result_json(const StressResult& result) {
  json faults = json::object();
  for (std::size_t i = 0; i < kStressCheckIds.size(); ++i)
    if (result.faults.at(i) > 0) faults[std::string(kStressCheckIds.at(i))] = result.faults.at(i);
  json line = {{"extreme", result.extreme},
               {"technique", result.technique},
               {"map", result.map},
               {"format", result.format},
               {"settings", result.settings},
               {"backend", result.backend},
               {"guarantee", guarantee_id(result.guarantee)}};
  if (!result.skipped.empty()) {
    line["skipped"] = result.skipped;
    if (result.is_lost) line["holds"] = false;
    return line;
  }
  line.update({{"holds", result.holds()},
               {"faults", std::move(faults)},
               {"pixels", result.pixels},
               {"capped", result.capped},
               {"unresolved", result.unresolved},
               {"missed_rate", result.missed_rate},
               {"unconverged_rate", result.unconverged_rate},
               {"e_xy_p99", result.e_xy_p99},
               {"e_xy_max", result.e_xy_max},
               {"differing_rate", result.differing_rate}});
  return line;
}

}  // namespace

json stress_json(const StressReport& report) {
  json extremes = json::array();
  for (const Extreme& extreme : report.extremes) extremes.push_back({{"id", extreme.id}, {"about", extreme.about}});
  json results = json::array();
  for (const StressResult& result : report.results) results.push_back(result_json(result));
  json worst = json::array();
  for (const StressPicture& picture : report.pictures) worst.push_back(result_json(picture.result));
  json whole = {{"schema", kStressSchema},         {"checks", kStressCheckIds}, {"techniques", report.techniques},
                {"extremes", std::move(extremes)}, {"devices", report.devices}, {"holds", report.holds()},
                {"wall_s", report.wall_s},         {"worst", std::move(worst)}, {"results", std::move(results)}};
  if (report.undone > 0) whole["undone"] = report.undone;
  return whole;
}

}  // namespace reliefbench
