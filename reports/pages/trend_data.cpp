#include "reports/pages/trend_data.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "kernels/base/clock.h"
#include "kernels/base/rounding.h"
#include "tuner/decide/epochs.h"
#include "tuner/decide/track_text.h"
#include "tuner/history/moment.h"
#include "tuner/history/series_name.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// Numbers take most of the page: six digits tell more than any night does.
json short_number(double value) { return std::isfinite(value) ? json(rounded_to_digits(value, 6)) : json(nullptr); }

/// Rows by their ids: a page's lists name each other by place.
class Places {
 public:
  void add(std::int64_t id) { places_.try_emplace(id, places_.size()); }
  [[nodiscard]] std::size_t of(std::int64_t id) const { return places_.at(id); }
  /// null where the row is not on the page
  [[nodiscard]] json maybe(std::int64_t id) const {
    const auto found = places_.find(id);
    return found == places_.end() ? json(nullptr) : json(found->second);
  }

 private:
  std::map<std::int64_t, std::size_t> places_;
};

/// A history as the page's lists have it.
class TrendPage {
 public:
  TrendPage(const HistoryView& view, const TrackCheck& check) : view_(view), check_(check), epochs_(view) {
    for (const RunRow& run : view.runs) {
      runs_.add(run.id);
      if (std::ranges::find(machines_, run.machine) == machines_.end()) machines_.push_back(run.machine);
    }
    for (const SeriesRow& series : view.series) series_.add(series.id);
    for (const EnvironmentRow& row : view.environments) environments_.add(row.id);
    for (const EpochChanges& epoch : check.epochs) epochs_of_series_[epoch.series].push_back(&epoch);
    for (const EventRow& event : check.events)
      for (const std::int64_t id : event.series) events_of_series_[id].push_back(event.id);
  }

  [[nodiscard]] json machines() const {
    json rows = json::array();
    for (const std::string& name : machines_) rows.push_back(machine(name));
    return rows;
  }

  [[nodiscard]] json environments() const {
    json rows = json::array();
    for (const EnvironmentRow& row : view_.environments)
      rows.push_back({{"hash", row.hash.substr(0, 8)}, {"text", environment_text(row)}});
    return rows;
  }

  [[nodiscard]] json runs() const {
    json rows = json::array();
    std::map<std::pair<std::string, std::size_t>, std::int64_t> environments;  // of machines' epochs
    for (std::size_t i = 0; i < view_.runs.size(); ++i) {
      const RunRow& run = view_.runs[i];
      const std::int64_t environment =
          environments.emplace(std::pair(run.machine, epochs_.of_machine(i)), run.environment).first->second;
      rows.push_back({{"time", moment_text(run.unix_s)},
                      {"commit", run.build.commit},
                      {"parent", run.build.parent},
                      {"dirty", run.build.is_dirty},
                      {"machine", place_of(run.machine)},
                      {"environment", environments_.of(environment)},
                      {"source", run.source}});
    }
    return rows;
  }

  [[nodiscard]] json events() const {
    json rows = json::array();
    for (const EventRow& event : check_.events) rows.push_back(this->event(event));
    return rows;
  }

  [[nodiscard]] json series() const {
    json rows = json::array();
    for (std::size_t s = 0; s < view_.series.size(); ++s) rows.push_back(one_series(s));
    return rows;
  }

  [[nodiscard]] json annotations() const {
    json rows = json::array();
    for (const AnnotationRow& note : view_.annotations)
      rows.push_back({{"run", note.run == 0 ? json(nullptr) : runs_.maybe(note.run)},
                      {"event", note.event == 0 ? json(nullptr) : json(note.event)},
                      {"time", moment_text(note.unix_s)},
                      {"by", note.by},
                      {"text", note.text}});
    return rows;
  }

 private:
  [[nodiscard]] std::size_t place_of(const std::string& machine) const {
    return static_cast<std::size_t>(std::ranges::find(machines_, machine) - machines_.begin());
  }

  /// machine: one that has a run
  [[nodiscard]] const RunRow& last_run_of(const std::string& machine) const {
    return *std::find_if(view_.runs.rbegin(), view_.runs.rend(),
                         [&](const RunRow& run) { return run.machine == machine; });
  }

  [[nodiscard]] json machine(const std::string& name) const {
    const RunRow& last = last_run_of(name);
    std::vector<double> sigmas;
    std::vector<double> shifts;
    for (const auto& [s, epochs] : epochs_of_series_) {
      if (view_.series[s].machine != name) continue;
      sigmas.push_back(epochs.back()->changes.sigma);
      if (!epochs.back()->changes.drift) shifts.push_back(epochs.back()->changes.smallest_shift);
    }
    return {{"name", name},
            {"nights", std::ranges::count(view_.runs, name, &RunRow::machine)},
            {"last", moment_text(last.unix_s)},
            {"noise", sigmas.empty() ? json(nullptr) : short_number(median(sigmas))},
            {"smallest_shift", shifts.empty() ? json(nullptr) : short_number(median(shifts))},
            {"devices", devices(last)}};
  }

  /// The devices of a machine's last run, each with its control case through all nights.
  [[nodiscard]] json devices(const RunRow& last) const {
    json rows = json::array();
    for (json device : last.health.value("devices", json::array())) {
      const std::string name = device_name(device.value("backend", ""), device.value("name", ""));
      json nights = json::array();
      json control = json::array();
      for (std::size_t run = 0; run < view_.runs.size(); ++run) {
        if (view_.runs[run].machine != last.machine) continue;
        for (const CalibrationRow& row : view_.runs[run].calibrations) {
          if (row.device != name) continue;
          nights.push_back(run);
          control.push_back(short_number(row.control_ns));
        }
      }
      device["calibration"] = {{"nights", nights}, {"control_ns", control}};
      rows.push_back(std::move(device));
    }
    return rows;
  }

  [[nodiscard]] json event(const EventRow& event) const {
    json series = json::array();
    for (const std::int64_t id : event.series)
      if (const json place = series_.maybe(id); !place.is_null()) series.push_back(place);
    json states = json::array();
    for (const EventStateRow& state : event.states)
      states.push_back({{"time", moment_text(state.unix_s)},
                        {"state", event_state_id(state.state)},
                        {"by", state.by},
                        {"text", state.text}});
    const auto size = [&](double share) { return has_size(event) ? short_number(share) : json(nullptr); };
    const auto commit_of = [&](std::int64_t run) {
      const json place = runs_.maybe(run);
      return place.is_null() ? json(nullptr) : json(view_.runs[place.get<std::size_t>()].build.commit);
    };
    return {{"id", event.id},
            {"state", event_state_id(event.states.back().state)},
            {"kind", event.kind},
            {"what", event.what},
            {"machine", place_of(event.machine)},
            {"good_run", runs_.maybe(event.good_run)},
            {"bad_run", runs_.maybe(event.bad_run)},
            {"commits", {commit_of(event.good_run), commit_of(event.bad_run)}},
            {"effect", size(event.effect)},
            {"low", size(event.low)},
            {"high", size(event.high)},
            {"q", event.q},
            {"series", series},
            {"text", event.states.back().text},
            {"states", states}};
  }

  /// What a relative time is multiplied by, so that an epoch's times are ms of its median night.
  [[nodiscard]] double scale_of(const SeriesRow& series, std::size_t epoch) const {
    if (series.scene_key.empty()) return 1;
    std::vector<double> control;
    for (std::size_t run = 0; run < view_.runs.size(); ++run) {
      if (view_.runs[run].machine != series.machine) continue;
      for (const CalibrationRow& row : view_.runs[run].calibrations)
        if (row.device == series.device && epochs_.of(run, row.device) == epoch) control.push_back(row.control_ns);
    }
    return control.empty() ? 1 : median(control);
  }

  [[nodiscard]] json one_series(std::size_t s) const {
    const SeriesRow& row = view_.series[s];
    const std::vector<RepetitionRow>& nights = view_.nights[s];
    std::map<std::size_t, double> scales;  // by epoch
    const auto scale_of_run = [&](std::size_t run) {
      const std::size_t epoch = epochs_.of(run, row.device);
      const auto [found, is_new] = scales.try_emplace(epoch, 1);
      if (is_new) found->second = scale_of(row, epoch);
      return found->second;
    };
    json places = json::array();
    json values = json::array();
    json errors = json::array();
    json invalid = json::array();
    json scores = json::array();
    std::int64_t score = 0;
    for (std::size_t i = 0; i < nights.size(); ++i) {
      const RepetitionRow& night = nights[i];
      const std::size_t run = runs_.of(night.run);
      places.push_back(run);
      if (!night.is_valid) invalid.push_back(i);
      values.push_back(night.value > 0 ? short_number(night.value * scale_of_run(run)) : json(nullptr));
      errors.push_back(short_number(night.standard_error));
      if (night.score != 0 && night.score != score) scores.push_back({i, night.score});
      if (night.score != 0) score = night.score;
    }
    json made = {{"id", row.id},
                 {"device", device_of(row)},
                 {"name", series_setting_name(row)},
                 {"setting", row.case_id},
                 {"scene", row.scene},
                 {"technique", row.technique},
                 {"map", row.map},
                 {"format", row.format},
                 {"backend", row.backend},
                 {"machine", place_of(row.machine)},
                 {"metric", row.metric},
                 {"unit", row.unit},
                 {"nights", std::move(places)},
                 {"values", std::move(values)},
                 {"errors", std::move(errors)},
                 {"invalid", std::move(invalid)},
                 {"scores", std::move(scores)},
                 {"events", events_of(row.id)}};
    add_changes(made, s, scale_of_run);
    return made;
  }

  /// Its place among the devices of its machine's last run; null where that has it not.
  [[nodiscard]] json device_of(const SeriesRow& row) const {
    const json devices = last_run_of(row.machine).health.value("devices", json::array());
    for (std::size_t i = 0; i < devices.size(); ++i)
      if (device_name(devices[i].value("backend", ""), devices[i].value("name", "")) == row.device) return i;
    return nullptr;
  }

  [[nodiscard]] json events_of(std::int64_t series) const {
    const auto found = events_of_series_.find(series);
    return found == events_of_series_.end() ? json::array() : json(found->second);
  }

  template <typename Scale>
  void add_changes(json& made, std::size_t s, const Scale& scale_of_run) const {
    made["levels"] = json::array();
    made["spikes"] = json::array();
    for (const char* key : {"drift", "sigma", "smallest_shift", "autocorrelation"}) made[key] = nullptr;
    const auto found = epochs_of_series_.find(s);
    if (found == epochs_of_series_.end()) return;
    for (const EpochChanges* epoch : found->second) {
      const double scale = scale_of_run(runs_.of(view_.nights[s][epoch->nights.front()].run));
      for (const Level& level : epoch->changes.levels) {
        const double margin = 1.96 * level.standard_error;
        made["levels"].push_back({{"first", epoch->nights[level.first]},
                                  {"end", epoch->nights[level.end - 1] + 1},
                                  {"value", short_number(scale * std::exp(level.log_value))},
                                  {"low", short_number(scale * std::exp(level.log_value - margin))},
                                  {"high", short_number(scale * std::exp(level.log_value + margin))}});
      }
      for (const std::size_t spike : epoch->changes.spikes) made["spikes"].push_back(epoch->nights[spike]);
    }
    const SeriesChanges& last = found->second.back()->changes;
    made["sigma"] = short_number(last.sigma);
    if (!last.drift) {  // these are about the mean, from which a drift runs away
      made["smallest_shift"] = short_number(last.smallest_shift);
      made["autocorrelation"] = short_number(last.autocorrelation);
      return;
    }
    made["drift"] = {{"per_night", short_number(std::expm1(last.drift->log_ratio_per_night))},
                     {"low", short_number(std::expm1(last.drift->low))},
                     {"high", short_number(std::expm1(last.drift->high))}};
  }

  const HistoryView& view_;
  const TrackCheck& check_;
  Epochs epochs_;
  std::vector<std::string> machines_;
  Places runs_;
  Places series_;
  Places environments_;
  std::map<std::size_t, std::vector<const EpochChanges*>> epochs_of_series_;
  std::map<std::int64_t, std::vector<std::int64_t>> events_of_series_;
};

}  // namespace

json trend_data_json(const HistoryView& view, const TrackCheck& check, const EventOptions& options,
                     const std::string& title) {
  const TrendPage page(view, check);
  return {{"title", title},
          {"made", utc_text(unix_ns())},
          {"options",
           {{"least_effect", options.change.least_effect},
            {"least_nights", options.change.least_nights},
            {"false_discovery_rate", options.false_discovery_rate},
            {"confidence", options.change.confidence}}},
          {"verdict",
           {{"exit", exit_of(check, view, false)},
            {"text", verdict_text(view, check)},
            {"nights_to_wait", check.coverage.nights_to_wait}}},
          {"machines", page.machines()},
          {"environments", page.environments()},
          {"runs", page.runs()},
          {"events", page.events()},
          {"series", page.series()},
          {"annotations", page.annotations()}};
}

}  // namespace reliefbench
