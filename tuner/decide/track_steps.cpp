#include "tuner/decide/track_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "tuner/decide/epochs.h"
#include "tuner/decide/night_effect.h"
#include "tuner/history/series_name.h"
#include "tuner/history/standard_error.h"
#include "tuner/results/record.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

/// One series of find_events(): a case in an epoch, or a device's control case.
struct CheckedPiece {
  std::optional<std::size_t> series;  ///< none: the control case
  std::vector<std::size_t> nights;    ///< of the case
  std::string machine;
  std::string device;
};

struct CheckedPieces {
  std::vector<CheckedPiece> pieces;
  std::vector<CheckedSeries> series;  ///< parallel
};

/// An epoch of a machine as one name; pooling never goes across it.
std::string epoch_name(std::string_view machine, std::size_t epoch) { return fmt::format("{}\n{}", machine, epoch); }

std::map<std::int64_t, std::size_t> places_of_runs(const HistoryView& view) {
  std::map<std::int64_t, std::size_t> places;
  for (std::size_t i = 0; i < view.runs.size(); ++i) places[view.runs[i].id] = i;
  return places;
}

std::string backend_of(const std::string& device) { return device.substr(0, device.find(' ')); }

void add_cases(const HistoryView& view, const Epochs& epochs, CheckedPieces& checked) {
  const std::map<std::int64_t, std::size_t> places = places_of_runs(view);
  for (std::size_t s = 0; s < view.series.size(); ++s) {
    const SeriesRow& row = view.series[s];
    std::map<std::size_t, std::size_t> pieces;  // by epoch
    for (std::size_t night = 0; night < view.nights[s].size(); ++night) {
      const RepetitionRow& value = view.nights[s][night];
      if (!value.is_valid) continue;
      const std::size_t run = places.at(value.run);
      const std::size_t epoch = epochs.of(run, row.device);
      const auto [piece, is_new] = pieces.try_emplace(epoch, checked.pieces.size());
      if (is_new) {
        checked.pieces.push_back({.series = s, .nights = {}, .machine = row.machine, .device = row.device});
        checked.series.push_back({.traits = {.machine = epoch_name(row.machine, epoch),
                                             .backend = row.backend,
                                             .technique = row.technique,
                                             .map = row.map,
                                             .format = row.format,
                                             .scene = row.scene},
                                  .calendar = {},
                                  .log_values = {},
                                  .standard_errors = {}});
      }
      checked.pieces[piece->second].nights.push_back(night);
      CheckedSeries& series = checked.series[piece->second];
      series.calendar.push_back(run);
      series.log_values.push_back(std::log(value.value));
      series.standard_errors.push_back(value.standard_error);
    }
  }
}

void add_controls(const HistoryView& view, const Epochs& epochs, CheckedPieces& checked) {
  std::map<std::pair<std::string, std::string>, std::size_t> places;  // epoch's name, device
  for (std::size_t run = 0; run < view.runs.size(); ++run) {
    const RunRow& row = view.runs[run];
    for (const CalibrationRow& control : row.calibrations) {
      if (!(control.control_ns > 0) || !std::isfinite(control.control_ns)) continue;
      const std::string epoch = epoch_name(row.machine, epochs.of(run, control.device));
      const auto [found, is_new] = places.try_emplace({epoch, control.device}, checked.pieces.size());
      if (is_new) {
        checked.pieces.push_back({.series = {}, .nights = {}, .machine = row.machine, .device = control.device});
        checked.series.push_back({.traits = {.machine = epoch,
                                             .backend = backend_of(control.device),
                                             .technique = {},
                                             .map = {},
                                             .format = {},
                                             .scene = {},
                                             .is_control = true},
                                  .calendar = {},
                                  .log_values = {},
                                  .standard_errors = {}});
      }
      CheckedSeries& series = checked.series[found->second];
      series.calendar.push_back(run);
      series.log_values.push_back(std::log(control.control_ns));
      series.standard_errors.push_back(log_median_error(control.control_ns, control.mad, control.n));
    }
  }
}

EventRow event_between(const std::string& machine, std::int64_t good_run, std::int64_t bad_run) {
  EventRow row;
  row.machine = machine;
  row.good_run = good_run;
  row.bad_run = bad_run;
  row.algorithm = kChangesVersion;
  return row;
}

/// The codes of an event's series on either side: whether any of them is another one.
enum class CodeChange { none, some, unknown };
CodeChange code_change(const HistoryView& view, std::span<const std::size_t> series, std::int64_t good_run,
                       std::int64_t bad_run) {
  CodeChange result = CodeChange::none;
  for (const std::size_t s : series) {
    const auto code_in = [&](std::int64_t run) {
      const auto night = std::ranges::find(view.nights[s], run, &RepetitionRow::run);
      return night == view.nights[s].end() ? std::string() : night->code;
    };
    const std::string before = code_in(good_run);
    const std::string after = code_in(bad_run);
    if (before.empty() || after.empty())
      result = CodeChange::unknown;
    else if (before != after)
      return CodeChange::some;
  }
  return result;
}

bool is_control_event(const ChangeEvent& event, const CheckedPieces& checked) {
  return std::ranges::any_of(event.series, [&](std::size_t i) { return !checked.pieces[i].series; });
}

/// Whether two events of a machine's epoch share nights.
bool is_at_once(const ChangeEvent& a, const ChangeEvent& b, const CheckedPieces& checked) {
  return checked.series[a.series.front()].traits.machine == checked.series[b.series.front()].traits.machine &&
         a.good < b.bad && b.good < a.bad;
}

/// Whether the control case of each of an event's devices moved in its nights, and half as far at least.
bool moved_along(const ChangeEvent& event, std::span<const ChangeEvent> all, const CheckedPieces& checked) {
  const auto has_moved = [&](const std::string& device) {
    return std::ranges::any_of(all, [&](const ChangeEvent& other) {
      return is_control_event(other, checked) && checked.pieces[other.series.front()].device == device &&
             is_at_once(event, other, checked) && std::abs(other.log_ratio) >= 0.5 * std::abs(event.log_ratio);
    });
  };
  return std::ranges::all_of(event.series, [&](std::size_t i) { return has_moved(checked.pieces[i].device); });
}

bool holds_all_of(const ChangeEvent& event, const ChangeEvent& part) {
  return std::ranges::all_of(part.series,
                             [&](std::size_t i) { return std::ranges::find(event.series, i) != event.series.end(); });
}

/// Adds the groups that show beside what a night's cases share: of a minority of a machine's cases, since the rest
/// would seem to go the other way; where nothing else is seen in their nights but parts of them, in whose place they
/// come.
void add_hidden_groups(const CheckedPieces& checked, const EventOptions& options, std::vector<ChangeEvent>& events) {
  const std::optional<std::vector<CheckedSeries>> rests = without_night_effects(checked.series);
  if (!rests) return;
  for (const ChangeEvent& group : find_events(*rests, options).events) {
    const std::string& machine = checked.series[group.series.front()].traits.machine;
    const auto of_machine = std::ranges::count_if(checked.series, [&](const CheckedSeries& series) {
      return series.traits.machine == machine && !series.traits.is_control;
    });
    const auto is_part = [&](const ChangeEvent& other) {
      return is_at_once(group, other, checked) && holds_all_of(group, other);
    };
    const bool is_told = std::ranges::any_of(
        events, [&](const ChangeEvent& other) { return is_at_once(group, other, checked) && !is_part(other); });
    if (is_told || group.what.empty() || 2 * static_cast<std::ptrdiff_t>(group.series.size()) > of_machine) continue;
    std::erase_if(events, is_part);
    events.push_back(group);
  }
}

bool matters(const ChangeEvent& event, const EventOptions& options) {
  const double least = std::log1p(options.change.least_effect);
  return event.is_drift || event.low > least || event.high < -least;
}

/// A series' name, and what its case has others of: metrics, devices.
std::string name_among(const HistoryView& view, std::size_t place) {
  const SeriesRow& row = view.series[place];
  bool has_metrics = false;
  bool has_devices = false;
  for (const SeriesRow& other : view.series) {
    if (other.case_id != row.case_id || other.machine != row.machine) continue;
    has_metrics |= other.metric != row.metric;
    has_devices |= other.device != row.device;
  }
  return series_name(row) + (has_metrics ? ", " + row.metric : "") + (has_devices ? " on " + row.device : "");
}

/// What an event's series have in common, for people.
std::string common_name(const HistoryView& view, std::span<const std::size_t> series) {
  if (series.size() == 1) return name_among(view, series.front());
  const SeriesRow& first = view.series[series.front()];
  const auto all = [&](auto member) {
    return std::ranges::all_of(series, [&](std::size_t s) { return view.series[s].*member == first.*member; });
  };
  std::string name = fmt::format("{} cases", series.size());
  if (all(&SeriesRow::backend)) name += " on " + first.backend;
  if (all(&SeriesRow::technique)) name += ", technique=" + first.technique;
  return name;
}

SeenEvent seen_step(const HistoryView& view, const ChangeEvent& event, std::span<const ChangeEvent> all,
                    const CheckedPieces& checked) {
  const CheckedPiece& first = checked.pieces[event.series.front()];
  SeenEvent seen{.row = event_between(first.machine, view.runs[event.good].id, view.runs[event.bad].id)};
  EventRow& row = seen.row;
  row.effect = std::expm1(event.log_ratio);
  row.low = std::expm1(event.low);
  row.high = std::expm1(event.high);
  row.q = event.q;
  seen.state = event.is_sure ? EventState::confirmed : EventState::suspect;
  if (!first.series) {
    row.kind = event.log_ratio > 0 ? event_kind::slower : event_kind::faster;
    row.what = fmt::format("the control case on {}", first.device);
    seen.state = EventState::environment;
    seen.reason = "its work never changes";
    return seen;
  }
  std::vector<std::size_t> series;
  for (const std::size_t i : event.series) series.push_back(*checked.pieces[i].series);
  for (const std::size_t s : series) row.series.push_back(view.series[s].id);
  const bool is_worse = (event.log_ratio > 0) == view.series[series.front()].lower_is_better;
  row.kind = !is_worse ? event_kind::faster : (event.is_drift ? event_kind::drift : event_kind::slower);
  row.what = event.what.empty() ? name_among(view, series.front()) : event.what;
  switch (code_change(view, series, row.good_run, row.bad_run)) {
    case CodeChange::some:
      seen.reason = "what is drawn changed as well: shaders, driver or stages";
      break;
    case CodeChange::none:
      seen.reason = "shaders, driver and stages are the same on both sides";
      if (!moved_along(event, all, checked)) break;
      seen.state = EventState::environment;
      seen.reason += ", and the control case moved along";
      break;
    case CodeChange::unknown:
      break;
  }
  return seen;
}

/// What no test is needed for: cases that changed for certain.
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

StepCheck check_steps(const HistoryView& view, const EventOptions& options) {
  const Epochs epochs(view);
  CheckedPieces checked;
  add_cases(view, epochs, checked);
  add_controls(view, epochs, checked);
  Findings findings = find_events(checked.series, options);
  add_hidden_groups(checked, options, findings.events);

  StepCheck result;
  for (const ChangeEvent& event : findings.events)
    if (matters(event, options)) result.events.push_back(seen_step(view, event, findings.events, checked));
  for (std::size_t i = 0; i < checked.pieces.size(); ++i) {
    CheckedPiece& piece = checked.pieces[i];
    if (piece.series)
      result.epochs.push_back(
          {.series = *piece.series, .nights = std::move(piece.nights), .changes = std::move(findings.series[i])});
  }
  std::ranges::sort(result.epochs, {},
                    [](const EpochChanges& epoch) { return std::pair(epoch.series, epoch.nights.back()); });
  std::map<std::size_t, double> shifts;  // of each series' last epoch
  for (const EpochChanges& epoch : result.epochs)
    if (epoch.nights.size() >= options.change.least_nights) shifts[epoch.series] = epoch.changes.smallest_shift;
  std::vector<double> values;
  for (const auto& [series, shift] : shifts)
    if (std::isfinite(shift) && shift > 0) values.push_back(shift);
  result.case_shift = values.empty() ? 0 : median(values);
  return result;
}

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
