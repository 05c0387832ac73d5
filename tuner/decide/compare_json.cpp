#include <cmath>
#include <nlohmann/json.hpp>

#include "tuner/decide/compare.h"

namespace reliefbench {
namespace {

nlohmann::json or_null(std::optional<double> value) { return value ? nlohmann::json(*value) : nlohmann::json(); }

/// JSON has no infinity: an unbounded end is null.
nlohmann::json time_change_json(const TimeChange& change) {
  const auto end = [](double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); };
  return {{"ratio", change.ratio.ratio},
          {"ci", {end(change.ratio.low), end(change.ratio.high)}},
          {"p", change.p},
          {"change", change_id(change.change)},
          {"reason", reason_id(change.reason)}};
}

}  // namespace

nlohmann::json comparison_json(const Comparison& comparison) {
  nlohmann::json cases = nlohmann::json::array();
  for (const CaseChange& c : comparison.cases) {
    cases.push_back(time_change_json(c));
    cases.back()["case"] = c.case_id;
  }
  nlohmann::json groups = nlohmann::json::array();
  for (const GroupChange& group : comparison.groups) {
    groups.push_back(time_change_json(group));
    groups.back().update({{"group", group.group}, {"cases", group.cases}});
  }
  nlohmann::json errors = nlohmann::json::array();
  for (const ErrorChange& e : comparison.errors) {
    errors.push_back({{"case", e.case_id},
                      {"metric", e.metric},
                      {"base", or_null(e.base)},
                      {"new", or_null(e.now)},
                      {"change", error_change_id(e)}});
  }
  nlohmann::json control = nlohmann::json::object();
  for (const auto& [backend, ratio] : comparison.control_ratio) control[backend] = ratio;
  nlohmann::json between_runs = nlohmann::json::object();
  for (const auto& [backend, deviation] : comparison.between_runs) between_runs[backend] = deviation;
  return {{"schema", kSchemaVersion},
          {"metric", comparison.metric},
          {"matched", comparison.matched},
          {"geometric_mean", comparison.groups.empty() ? 1.0 : comparison.groups.front().ratio.ratio},
          {"verdict", verdict_id(comparison)},
          {"inconclusive", is_inconclusive(comparison)},
          {"control_ratio", std::move(control)},
          {"between_runs", std::move(between_runs)},
          {"assumed", comparison.assumed},
          {"environment", environment_json(comparison.environment)},
          {"drivers", comparison.drivers},
          {"groups", std::move(groups)},
          {"cases", std::move(cases)},
          {"errors", std::move(errors)},
          {"lost", comparison.lost},
          {"only_base", comparison.only_base},
          {"only_new", comparison.only_new},
          {"warnings", comparison.warnings}};
}

}  // namespace reliefbench
