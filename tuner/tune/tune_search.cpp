#include "tuner/tune/tune_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "kernels/base/clock.h"
#include "tuner/decide/choose.h"
#include "tuner/plan/features.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

/// What `more` has and `less` has not.
std::vector<std::string> without(const std::vector<std::string>& more, const std::vector<std::string>& less) {
  std::vector<std::string> rest;
  std::ranges::copy_if(more, std::back_inserter(rest),
                       [&](const std::string& feature) { return std::ranges::find(less, feature) == less.end(); });
  return rest;
}

/// Whether a time is within the question's bound on it.
bool is_in_time(double high_ns, const TuneQuestion& question) {
  return !question.max_time_ms || high_ns <= *question.max_time_ms * kNsPerMs;
}

/// Rungs from the measured settings that are as accurate as the pick is asked to be, and as fast.
std::vector<TuneRung> rungs_of(const TuneResult& result, double max_error) {
  std::vector<RungCandidate> candidates;
  for (std::size_t i = 0; i < result.space.candidates.size(); ++i) {
    const Candidate& candidate = result.space.candidates[i];
    const CandidateState& state = result.search.states[i];
    if (!candidate.is_feasible || candidate.error > max_error || !state.high_ns) continue;
    if (!is_in_time(*state.high_ns, result.question)) continue;
    const Settings settings = parse_setting(candidate.id);
    candidates.push_back({.index = i,
                          .features = features(settings),
                          .simplicity = simplicity(settings).technique,
                          .time_ns = *state.high_ns});
  }
  std::vector<TuneRung> rungs;
  std::vector<std::string> before;
  for (const std::size_t rung : ladder(candidates)) {
    const RungCandidate& candidate = candidates[rung];
    const CandidateState& state = result.search.states[candidate.index];
    rungs.push_back({.setting = result.space.candidates[candidate.index].id,
                     .gained = without(candidate.features, before),
                     .dropped = without(before, candidate.features),
                     .time_ns = state.time_ns.value_or(*state.high_ns),
                     .high_ns = *state.high_ns});
    before = candidate.features;
  }
  return rungs;
}

}  // namespace

void BookSource::will_ask(std::span<const FrameOf> round) {
  std::vector<Wanted> missing;
  for (const FrameOf& frame : round)
    for (std::size_t scene = 0; scene < scenes_.size(); ++scene)
      if (book_.times(scenes_[scene].case_ids[frame.candidate]).size() <= static_cast<std::size_t>(frame.index))
        missing.push_back({.scene = scene, .candidate = frame.candidate});
  if (!missing.empty()) draw_(missing);
}

double BookSource::frame_ns(std::size_t candidate, int index) {
  double combined_ns = 0;
  for (std::size_t scene = 0; scene < scenes_.size(); ++scene) {
    const std::string& id = scenes_[scene].case_ids[candidate];
    while (book_.times(id).size() <= static_cast<std::size_t>(index))
      draw_(std::array{Wanted{.scene = scene, .candidate = candidate}});
    combined_ns =
        combined(combine_, combined_ns, scenes_[scene].weight, book_.times(id)[static_cast<std::size_t>(index)]);
  }
  return combined_ns;
}

double combined(Combine combine, double so_far, double weight, double value) {
  return combine == Combine::worst ? std::max(so_far, value) : so_far + weight * value;
}

bool has_one_answer(const TuneQuestion& question) { return !question.max_error.empty() && !question.max_time_ms; }

SearchSpace asked_space(const SearchSpace& space, const TuneQuestion& question, const FleetLosses* fleet) {
  SearchSpace asked = space;
  if (has_one_answer(question))
    for (Candidate& candidate : asked.candidates) candidate.error = fleet != nullptr ? fleet->loss(candidate.id) : 0;
  return asked;
}

std::vector<std::size_t> first_settings(const SearchSpace& space) {
  struct Simplest {
    std::tuple<std::size_t, double> effort;  // features, steps
    std::size_t candidate;
  };
  std::map<const Technique*, Simplest> simplest;  // by the order of techniques()
  for (std::size_t i = 0; i < space.candidates.size(); ++i) {
    const Candidate& candidate = space.candidates[i];
    if (!candidate.is_feasible) continue;
    const Settings settings = parse_setting(candidate.id);
    const double steps = std::accumulate(candidate.steps.begin(), candidate.steps.end(), 0.0);
    const Simplest own{.effort = {features(settings).size(), steps}, .candidate = i};
    const auto [known, is_new] = simplest.try_emplace(&settings.technique(), own);
    if (!is_new && own.effort < known->second.effort) known->second = own;
  }
  std::vector<std::size_t> first;
  first.reserve(simplest.size());
  for (const auto& [technique, own] : simplest) first.push_back(own.candidate);
  return first;
}

std::optional<TunePick> pick_of(const SearchResult& search, const SearchSpace& space, const TuneQuestion& question,
                                std::optional<double> budget, const MemoryOf& memory_of) {
  const BudgetAnswer* answer = nullptr;
  if (question.max_time_ms) {
    for (const BudgetAnswer& one : search.answers)  // by falling error, so rising time
      if (is_in_time(one.high_ns, question)) answer = &one;
  } else if (!search.answers.empty()) {
    answer = question.max_error.empty() && budget ? answer_for(search.answers, *budget) : &search.answers.back();
  }
  if (answer == nullptr) return std::nullopt;
  TunePick pick{.setting = space.candidates[answer->pick].id,
                .error = space.candidates[answer->pick].error,
                .time_ns = answer->time_ns,
                .high_ns = answer->high_ns,
                .rival_low_ns = answer->rival_low_ns,
                .gap = answer->gap};
  if (answer->gap > question.epsilon) return pick;

  double max_error = pick.error;
  if (has_one_answer(question)) max_error = std::numeric_limits<double>::infinity();
  if (!question.max_time_ms && budget) max_error = std::max(max_error, *budget);
  const double best_low_ns = std::min(*search.states[answer->pick].low_ns, answer->rival_low_ns);
  std::vector<std::size_t> settings;
  std::vector<Contender> contenders;
  for (std::size_t i = 0; i < space.candidates.size(); ++i) {
    const CandidateState& state = search.states[i];
    const bool does = space.candidates[i].is_feasible && space.candidates[i].error <= max_error;
    if (!does || state.evidence != Evidence::measured || !state.low_ns || !state.high_ns) continue;
    if (i != answer->pick && *state.high_ns > (1 + question.epsilon) * best_low_ns) continue;
    if (!is_in_time(*state.high_ns, question)) continue;
    settings.push_back(i);
    contenders.push_back({.simplicity = simplicity(parse_setting(space.candidates[i].id)),
                          .memory_bytes = memory_of(i),
                          .low_ns = *state.low_ns,
                          .high_ns = *state.high_ns});
  }
  const Choice choice = choose(contenders);
  if (choice.tie) pick.tie = space.candidates[settings[*choice.tie]].id;
  const std::size_t chosen = settings[choice.pick];
  if (chosen == answer->pick) return pick;
  const CandidateState& state = search.states[chosen];
  pick.setting = space.candidates[chosen].id;
  pick.error = space.candidates[chosen].error;
  pick.time_ns = state.time_ns.value_or(*state.high_ns);
  pick.high_ns = *state.high_ns;
  pick.rival_low_ns = best_low_ns;
  pick.gap = std::max(0.0, pick.high_ns / best_low_ns - 1);
  return pick;
}

std::pair<std::string, std::string> nearest_answer(const TuneResult& result, std::optional<double> budget) {
  const std::vector<BudgetAnswer>& answers = result.search.answers;
  if (answers.empty()) return {};
  const auto named = [&](const BudgetAnswer& answer, std::string miss) {
    return std::pair(result.space.candidates[answer.pick].id, std::move(miss));
  };
  if (const std::optional<double>& max_time_ms = result.question.max_time_ms)
    return named(answers.front(), fmt::format("the fastest takes up to {:.4g} ms where {:.4g} ms is asked",
                                              answers.front().high_ns / kNsPerMs, *max_time_ms));
  if (!budget) return {};
  return named(answers.back(), fmt::format("{} is {:.4g} where {:.4g} is asked", result.error_metric,
                                           answers.back().max_error, *budget));
}

void show(Progress& progress, const SearchProgress& now, const TuneQuestion& question, double time) {
  const double by_gap = now.worst_gap < 1 ? std::log(now.worst_gap) / std::log(question.epsilon) : 0;
  const std::string within = std::isinf(now.worst_gap)
                                 ? std::string()
                                 : fmt::format(", picks within {:.1f} % of the best", 100 * now.worst_gap);
  progress.update(std::clamp(std::max(by_gap, time), 0.0, 1.0),
                  fmt::format("{} settings timed, {} samples{}", now.measured, now.samples, within));
}

void search_into(TuneResult& result, TimeSource& times, const std::function<bool()>& should_stop,
                 const std::function<void(const SearchProgress&)>& on_progress, std::optional<double> budget,
                 std::int64_t max_samples, const MemoryOf& memory_of, const FleetLosses* fleet) {
  const TuneQuestion& question = result.question;
  result.search = search(asked_space(result.space, question, fleet), times,
                         {.epsilon = question.epsilon,
                          .confidence = question.confidence,
                          .seed = question.seed,
                          .regret = fleet != nullptr ? std::optional(fleet->rule) : std::nullopt,
                          .first = first_settings(result.space),
                          .max_samples = max_samples,
                          .should_stop = should_stop,
                          .on_progress = on_progress});
  result.pick = pick_of(result.search, result.space, question, budget, memory_of);
  if (!result.pick) return;
  double max_error = result.pick->error;
  if (has_one_answer(question)) max_error = std::numeric_limits<double>::infinity();
  if (!question.max_time_ms && question.max_error.empty()) max_error = budget.value_or(max_error);
  result.rungs = rungs_of(result, max_error);
}

}  // namespace reliefbench
