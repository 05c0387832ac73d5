#include "tuner/decide/track_certain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "tuner/results/record.h"

namespace reliefbench {
namespace {

void name_cases(EventRow& row, const char* kind, const HistoryView& view, std::span<const std::size_t> series) {
  row.kind = kind;
  row.what = common_name(view, series);
  row.q = 0;
  for (const std::size_t s : series) row.series.push_back(view.series[s].id);
}

/// "e_xy.p99 .31 -> .42": of the metric that changed most, and how many others did.
std::string changed_metrics(const nlohmann::json& before, const nlohmann::json& after) {
  std::string most;
  double most_size = -1;
  int count = 0;
  for (const auto& [id, value] : after.items()) {
    const nlohmann::json old = before.value(id, nlohmann::json());
    if (old == value) continue;
    ++count;
    const bool has_both = old.is_number() && value.is_number();
    const double size = has_both ? std::abs(value.get<double>() - old.get<double>()) /
                                       std::max({std::abs(value.get<double>()), std::abs(old.get<double>()), 1e-30})
                                 : 1;
    if (size <= most_size) continue;
    most_size = size;
    most = has_both ? fmt::format("{} {:.4g} -> {:.4g}", id, old.get<double>(), value.get<double>()) : id;
  }
  return count > 1 ? fmt::format("{}, and {} more metrics", most, count - 1) : most;
}

/// Whether a failure says something of the case, and not of the machine's night. "error": of a benchmark
bool is_of_the_case(std::string_view status) {
  return status == "error" || status == status_id(Status::crashed) || status == status_id(Status::compile_error) ||
         status == status_id(Status::unsupported);
}

/// Series that changed alike between the same two nights.
struct Together {
  std::vector<std::size_t> series;
  std::vector<std::size_t> undone;  ///< those that changed back since
  std::string text;
};

/// From a night to the next that has other errors.
struct ScoreChange {
  const RepetitionRow* before = nullptr;
  const RepetitionRow* after = nullptr;
  bool is_undone = false;  ///< a later night has the errors from before it again
};

/// A series' changes of errors, but for those that only lead back: to errors that it had since its base, which is what
/// came with other code or was accepted last.
/// is_accepted: whether the change that this run shows first is
template <typename IsAccepted>
std::vector<ScoreChange> error_changes(std::span<const RepetitionRow> nights, const IsAccepted& is_accepted) {
  std::vector<ScoreChange> changes;
  std::vector<std::int64_t> scores;  // from the base on, each other than those before it
  std::vector<std::size_t> ways;     // from one of these to the next: changes
  const RepetitionRow* before = nullptr;
  for (const RepetitionRow& night : nights) {
    if (night.score == 0) continue;
    const RepetitionRow* last = std::exchange(before, &night);
    if (last == nullptr) scores = {night.score};
    if (last == nullptr || last->score == night.score) continue;
    const auto known = std::ranges::find(scores, night.score);
    const bool leads_back = known != scores.end();
    if (leads_back) {
      const auto kept = static_cast<std::size_t>(known - scores.begin());
      for (std::size_t i = kept; i < ways.size(); ++i) changes[ways[i]].is_undone = true;
      scores.resize(kept + 1);
      ways.resize(kept);
    }
    const bool is_base = last->code != night.code || is_accepted(night.run);
    if (leads_back && !is_base) continue;
    changes.push_back({.before = last, .after = &night});
    if (is_base) {
      scores = {night.score};
      ways.clear();
    } else {
      scores.push_back(night.score);
      ways.push_back(changes.size() - 1);
    }
  }
  return changes;
}

/// Series and first runs of the other errors that a person accepted.
std::set<std::pair<std::int64_t, std::int64_t>> accepted_errors(const HistoryView& view) {
  std::set<std::pair<std::int64_t, std::int64_t>> accepted;
  for (const EventRow& event : view.events)
    if (event.kind == event_kind::errors && event.states.back().state == EventState::accepted)
      for (const std::int64_t series : event.series) accepted.emplace(series, event.bad_run);
  return accepted;
}

}  // namespace

std::vector<SeenEvent> changed_errors(const HistoryView& view) {
  std::map<std::int64_t, const nlohmann::json*> scores;
  for (const ScoreRow& score : view.scores) scores[score.id] = &score.values;
  const std::set<std::pair<std::int64_t, std::int64_t>> accepted = accepted_errors(view);
  std::map<std::tuple<std::string, std::int64_t, std::int64_t, bool>, Together> changes;
  for (std::size_t s = 0; s < view.series.size(); ++s) {
    const auto is_accepted = [&](std::int64_t run) { return accepted.contains({view.series[s].id, run}); };
    for (const ScoreChange& one : error_changes(view.nights[s], is_accepted)) {
      const RepetitionRow& before = *one.before;
      const RepetitionRow& after = *one.after;
      const bool is_code = before.code != after.code;
      Together& change = changes[{view.series[s].machine, before.run, after.run, is_code}];
      if (change.series.empty()) change.text = changed_metrics(*scores.at(before.score), *scores.at(after.score));
      (one.is_undone && !is_code ? change.undone : change.series).push_back(s);
    }
  }
  std::vector<SeenEvent> seen;
  for (const auto& [where, change] : changes) {
    const auto& [machine, good, bad, is_code] = where;
    SeenEvent event{.row = event_between(machine, good, bad)};
    const bool is_undone = change.series.empty();
    name_cases(event.row, event_kind::errors, view, is_undone ? change.undone : change.series);
    event.state = is_code ? EventState::accepted : (is_undone ? EventState::recovered : EventState::confirmed);
    event.reason = change.text;
    if (is_code)
      event.reason += "; what is drawn changed as well: shaders, driver or stages";
    else if (is_undone)
      event.reason += "; the errors from before it are back";
    else
      event.reason += "; shaders, bakers and driver are the same on both sides";
    seen.push_back(std::move(event));
  }
  return seen;
}

std::vector<SeenEvent> lost_cases(const HistoryView& view) {
  std::map<std::tuple<std::string, std::int64_t, std::int64_t, std::string, bool>, std::vector<std::size_t>> lost;
  for (std::size_t s = 0; s < view.series.size(); ++s) {
    const std::vector<RepetitionRow>& nights = view.nights[s];
    const auto last_ok =
        std::find_if(nights.rbegin(), nights.rend(), [](const RepetitionRow& night) { return night.status == "ok"; });
    if (last_ok == nights.rbegin() || last_ok == nights.rend()) continue;
    const auto first_bad = last_ok.base();
    const bool is_twice = nights.end() - first_bad >= 2;
    if (!is_twice && !is_of_the_case(first_bad->status)) continue;
    lost[{view.series[s].machine, last_ok->run, first_bad->run, first_bad->status, is_twice}].push_back(s);
  }
  std::vector<SeenEvent> seen;
  for (const auto& [where, series] : lost) {
    const auto& [machine, good, bad, status, is_twice] = where;
    SeenEvent event{.row = event_between(machine, good, bad)};
    name_cases(event.row, event_kind::lost, view, series);
    event.state = is_twice ? EventState::confirmed : EventState::suspect;
    event.reason = status;
    seen.push_back(std::move(event));
  }
  return seen;
}

}  // namespace reliefbench
