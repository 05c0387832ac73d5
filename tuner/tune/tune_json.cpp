#include <cmath>
#include <nlohmann/json.hpp>

#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// JSON has no infinity: an unbounded gap is null.
json finite(double value) { return std::isfinite(value) ? json(value) : json(); }
template <typename T>
json or_null(const std::optional<T>& value) {
  return value ? json(*value) : json();
}

std::string_view evidence_id(Evidence evidence) {
  switch (evidence) {
    case Evidence::none:
      return "none";
    case Evidence::assumed:
      return "assumed";
    case Evidence::measured:
      return "measured";
  }
  return "none";
}

json pick_json(const TunePick& pick, const TuneResult& result) {
  return {{"setting", pick.setting},
          {"error", pick.error},
          {"time_ns", pick.time_ns},
          {"high_ns", pick.high_ns},
          {"rival_low_ns", finite(pick.rival_low_ns)},
          {"gap", finite(result.gap_in_space(pick.gap))}};
}

json answers_json(const TuneResult& result) {
  json list = json::array();
  for (const BudgetAnswer& answer : result.search.answers)
    list.push_back({{"setting", result.space.candidates[answer.pick].id},
                    {"error", result.space.candidates[answer.pick].error},
                    {"time_ns", answer.time_ns},
                    {"high_ns", answer.high_ns},
                    {"rival_low_ns", finite(answer.rival_low_ns)},
                    {"gap", finite(result.gap_in_space(answer.gap))}});
  return list;
}

json states_json(const TuneResult& result) {
  json list = json::array();
  for (std::size_t i = 0; i < result.space.candidates.size(); ++i) {
    const Candidate& candidate = result.space.candidates[i];
    json line = {{"setting", candidate.id}, {"error", candidate.error}, {"feasible", candidate.is_feasible}};
    if (i < result.search.states.size()) {
      const CandidateState& state = result.search.states[i];
      line.update({{"evidence", evidence_id(state.evidence)},
                   {"samples", state.samples},
                   {"time_ns", or_null(state.time_ns)},
                   {"low_ns", or_null(state.low_ns)},
                   {"high_ns", or_null(state.high_ns)}});
    }
    list.push_back(std::move(line));
  }
  return list;
}

/// The settings whose error rests on a coarse filter.
json filter_marks_json(const TuneResult& result) {
  json marked = json::array();
  for (const Candidate& candidate : result.space.candidates)
    if (!result.filter.mark(candidate.id).empty()) marked.push_back(candidate.id);
  return {{"note", result.filter.note()}, {"marked", std::move(marked)}};
}

json path_json(const TuneResult& result) {
  json list = json::array();
  for (const PathPoint& point : result.search.path)
    list.push_back({{"samples", point.samples},
                    {"measured", point.measured},
                    {"worst_gap", finite(result.gap_in_space(point.worst_gap))},
                    {"timed_gap", finite(point.timed_gap)},
                    {"picks", point.picks}});
  return list;
}

json scenes_json(const TuneResult& result) {
  json list = json::array();
  for (const SceneAnswer& answer : result.scene_answers)
    list.push_back({{"scene", answer.scene},
                    {"own", answer.own ? pick_json(*answer.own, result) : json()},
                    {"own_time_ns", answer.own_ns},
                    {"common_time_ns", answer.common_ns},
                    {"gain", answer.gain},
                    {"gain_interval", {answer.gain_low, answer.gain_high}}});
  return list;
}

json holdout_json(const TuneResult& result) {
  json list = json::array();
  for (const HoldoutAnswer& answer : result.holdout)
    list.push_back({{"scene", answer.scene},
                    {"scene_key", answer.scene_key.hex},
                    {"failure", answer.failure},
                    {"meets", answer.failure.empty() && answer.miss.empty()},
                    {"miss", answer.miss},
                    {"error", or_null(answer.error)},
                    {"time_ns", answer.time_ns}});
  return list;
}

json fleet_answer_json(const TuneResult& result) {
  if (!result.fleet_refusal.empty()) return {{"refusal", result.fleet_refusal}};
  if (!result.fleet) return {};
  json told = fleet_json(result.fleet->fleet, result.fleet->runs, result.fleet->options);
  told["bounds"] = {finite(result.fleet->low), finite(result.fleet->high)};
  return told;
}

}  // namespace

json tune_json(const TuneResult& result) {
  json rungs = json::array();
  for (const TuneRung& rung : result.rungs)
    rungs.push_back({{"setting", rung.setting},
                     {"gained", rung.gained},
                     {"dropped", rung.dropped},
                     {"time_ns", rung.time_ns},
                     {"high_ns", rung.high_ns}});
  json scene_keys = json::array();
  for (const SceneKey& key : result.scene_keys) scene_keys.push_back(key.hex);
  const TuneCounts& counts = result.counts;
  const SearchResult& search = result.search;
  return {{"question",
           {{"max_error", budget_texts(result.question.max_error)},
            {"max_time_ms", or_null(result.question.max_time_ms)},
            {"epsilon", result.question.epsilon},
            {"confidence", result.question.confidence},
            {"seed", result.question.seed}}},
          {"error_metric", result.error_metric},
          {"constraints", budget_texts(result.constraints)},
          {"backend", result.backend},
          {"device", result.device},
          {"filter", filter_marks_json(result)},
          {"frame_notes", result.frame_notes},
          {"scenes", result.scenes},
          {"scene_keys", std::move(scene_keys)},
          {"replayed", result.replayed},
          {"space",
           {{"settings", counts.settings},
            {"conflicts", counts.conflicts},
            {"scored", counts.scored},
            {"assumed", counts.assumed},
            {"hopeless", counts.hopeless},
            {"failed", counts.failed},
            {"unscored", counts.unscored},
            {"bisected", counts.is_bisected}}},
          {"certificate",
           {{"held", result.is_certified()},
            {"claim", result.claim()},
            {"worst_gap", finite(result.gap_in_space(search.worst_gap))},
            {"scored_gap", finite(search.worst_gap)},
            {"correlation", search.correlation},
            {"samples", search.samples},
            {"measured", search.measured},
            {"slack", search.slack},
            {"audits", search.audits},
            {"audit_failures", search.audit_failures},
            {"stopped", result.is_stopped}}},
          {"pick", result.pick ? pick_json(*result.pick, result) : json()},
          {"tie", result.pick ? result.pick->tie : ""},
          {"nearest", result.nearest},
          {"miss", result.miss},
          {"rungs", std::move(rungs)},
          {"answers", answers_json(result)},
          {"scene_answers", scenes_json(result)},
          {"holdout", holdout_json(result)},
          {"fleet", fleet_answer_json(result)},
          {"settings", states_json(result)},
          {"path", path_json(result)}};
}

}  // namespace reliefbench
