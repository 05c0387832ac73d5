#include <nlohmann/json.hpp>

#include "tuner/decide/hardware.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using nlohmann::json;

json ratio_json(const RatioInterval& ratio) { return {{"ratio", ratio.ratio}, {"ci", {ratio.low, ratio.high}}}; }

json column_json(const DeviceColumn& column, std::size_t index, std::span<const FleetRun> runs) {
  json names = json::array();
  for (const std::size_t run : column.runs) names.push_back(runs[run].name);
  return {{"column", column_letter(index)},
          {"backend", column.device.backend},
          {"device", column.device.device},
          {"driver", column.device.driver},
          {"machine", column.device.machine},
          {"runs", names},
          {"cases", column.cases},
          {"between_runs", column.between_runs ? json(*column.between_runs) : json()}};
}

json pair_json(const DevicePair& pair) {
  json groups = json::array();
  for (const PairGroup& group : pair.groups) {
    groups.push_back(ratio_json(group.ratio));
    groups.back().update(
        {{"group", group.group}, {"cases", group.cases}, {"nine_in_ten", {group.low_case, group.high_case}}});
  }
  json ranks = json::array();
  for (const RankCorrelation& rank : pair.ranks)
    ranks.push_back(
        {{"scene", rank.scene}, {"cases", rank.cases}, {"spearman", rank.rho}, {"ci", {rank.low, rank.high}}});
  json cases = json::array();
  for (const PairCase& one : pair.cases) {
    cases.push_back(ratio_json(one.ratio));
    cases.back().update(
        {{"setting", one.setting}, {"scene", one.scene}, {"base_ns", one.base_ns}, {"new_ns", one.now_ns}});
  }
  return {{"base", column_letter(pair.base)},
          {"new", column_letter(pair.now)},
          {"groups", groups},
          {"rank_correlation", ranks},
          {"cases", cases}};
}

json front_json(const FrontSetting& one) {
  json columns = json::array();
  for (std::size_t c = 0; c < one.behind.size(); ++c)
    columns.push_back({{"error", one.errors[c]},
                       {"coarse_filter", one.rows[c]->coarse_filter},
                       {"behind", one.behind[c] ? json(*one.behind[c]) : json()},
                       {"on_front", static_cast<bool>(one.on_front[c])},
                       {"may_be_on_front", static_cast<bool>(one.may_be[c])}});
  return {{"setting", setting_id(one.settings)}, {"key", setting_key(one.settings)}, {"columns", columns}};
}

}  // namespace

json hardware_json(const HardwareComparison& comparison, std::span<const FleetRun> runs) {
  json columns = json::array();
  for (std::size_t c = 0; c < comparison.columns.size(); ++c)
    columns.push_back(column_json(comparison.columns[c], c, runs));
  json pairs = json::array();
  for (const DevicePair& pair : comparison.pairs) pairs.push_back(pair_json(pair));
  json fronts = json::array();
  for (const SceneFronts& scene : comparison.fronts) {
    json letters = json::array();
    for (const std::size_t column : scene.columns) letters.push_back(column_letter(column));
    json settings = json::array();
    for (const FrontSetting& one : scene.on_some) settings.push_back(front_json(one));
    fronts.push_back(
        {{"scene", scene.scene}, {"columns", letters}, {"settings", scene.settings}, {"on_some_front", settings}});
  }
  return {{"schema", kSchemaVersion},
          {"columns", columns},
          {"pairs", pairs},
          {"fronts", fronts},
          {"environment", environment_json(comparison.environment)},
          {"warnings", comparison.warnings},
          {"filter_notes", coarse_notes(comparison)}};
}

}  // namespace reliefbench
