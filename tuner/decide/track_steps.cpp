#include "tuner/decide/track_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "tuner/decide/epochs.h"
#include "tuner/decide/night_effect.h"
#include "tuner/history/standard_error.h"
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

}  // namespace reliefbench
