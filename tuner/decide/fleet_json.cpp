#include <nlohmann/json.hpp>

#include "tuner/decide/fleet.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

nlohmann::json loss_json(const Loss& loss) {
  return {{"loss", loss.value},
          {"interval", {loss.low, loss.high}},
          {"time_ns", loss.time_ns},
          {"coarse_filter", loss.row->coarse_filter}};
}

}  // namespace

nlohmann::json fleet_json(const Fleet& fleet, std::span<const FleetRun> runs, const FleetOptions& options) {
  nlohmann::json places = nlohmann::json::array();
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    const FleetPlace& place = fleet.places[p];
    nlohmann::json shipped = nlohmann::json::array();
    for (const std::optional<Loss>& loss : fleet.own[p].losses)
      shipped.push_back(loss ? loss_json(*loss) : nlohmann::json(nullptr));
    nlohmann::json names = nlohmann::json::array();
    for (const std::size_t run : place.runs) names.push_back(runs[run].name);
    places.push_back({{"runs", names},
                      {"backend", place.device.backend},
                      {"device", place.device.device},
                      {"driver", place.device.driver},
                      {"machine", place.device.machine},
                      {"scene", place.scene},
                      {"scene_key", place.scene_key.hex},
                      {"weight", place.weight},
                      {"settings", place.settings},
                      {"between_runs", place.between_runs ? nlohmann::json(*place.between_runs) : nlohmann::json()},
                      {"best", setting_id(fleet.own[p].settings)},
                      {"best_in_each_place", shipped}});
  }
  nlohmann::json settings = nlohmann::json::array();
  for (const FleetSetting& one : fleet.settings) {
    nlohmann::json losses = nlohmann::json::array();
    for (const Loss& loss : one.losses) losses.push_back(loss_json(loss));
    settings.push_back(
        {{"setting", setting_id(one.settings)},
         {"key", setting_key(one.settings)},
         {"combined", {{"loss", one.combined.value}, {"interval", {one.combined.low, one.combined.high}}}},
         {"places", losses},
         {"memory_bytes", one.memory_bytes}});
  }
  return {{"regret", regret_id(options.regret)},
          {"budgets", budget_texts(options.budgets)},
          {"max_time_ms", options.max_time_ms ? nlohmann::json(*options.max_time_ms) : nlohmann::json()},
          {"loss", options.max_time_ms ? options.error_metric : std::string("time")},
          {"confidence", options.confidence},
          {"places", places},
          {"ties", fleet.ties},
          {"settings", settings},
          {"filter_notes", coarse_notes(fleet)}};
}

}  // namespace reliefbench
