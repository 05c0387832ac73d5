#include "tuner/decide/track_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "tuner/decide/markup.h"
#include "tuner/history/moment.h"

namespace reliefbench {
namespace {

using nlohmann::json;

const RunRow* find_run(const HistoryView& view, std::int64_t id) {
  const auto found = std::ranges::find(view.runs, id, &RunRow::id);
  return found == view.runs.end() ? nullptr : &*found;
}

std::string day_text(std::int64_t unix_s) { return moment_text(unix_s).substr(0, 10); }

std::string day_of(const RunRow& run) { return day_text(run.unix_s); }

std::string short_commit(BuildRow build) {
  build.commit = build.commit.substr(0, 12);
  return commit_text(build);
}

/// "2 regressions"; nothing of none
std::string counted(std::ptrdiff_t count, std::string_view one, std::string_view many) {
  return count == 0 ? std::string() : fmt::format("{} {}", count, count == 1 ? one : many);
}

std::string size_text(double share) { return fmt::format("{:.1f} %", 100 * std::abs(share)); }

/// Rounded up: what is promised of a size must hold of the one that is printed.
std::string size_text_up(double share) { return fmt::format("{:.1f} %", std::ceil(1000 * share - 1e-9) / 10); }

bool is_in(const EventRow& event, EventState state) { return event.states.back().state == state; }

json run_json_of(const HistoryView& view, std::int64_t id) {
  const RunRow* run = find_run(view, id);
  if (run == nullptr) return nullptr;
  return {{"time", moment_text(run->unix_s)}, {"commit", commit_text(run->build)}, {"source", run->source}};
}

std::string event_line(const EventRow& event, const HistoryView& view) {
  const std::string& reason = event.states.back().text;
  return fmt::format("{}: {}, {}{}", event.what, effect_text(event), interval_text(event, view),
                     reason.empty() ? "" : "; " + reason);
}

}  // namespace

std::string effect_text(const EventRow& event) {
  if (event.kind == event_kind::errors) return "errors changed";
  if (event.kind == event_kind::lost) return "lost";
  const auto [low, high] = std::minmax({std::abs(event.low), std::abs(event.high)});
  const std::string interval = fmt::format("[{:.2g}, {:.2g}]", 100 * low, 100 * high);
  if (event.kind == event_kind::drift)
    return fmt::format("{} slower {}, little by little", size_text(event.effect), interval);
  return fmt::format("{} {} {}", size_text(event.effect), event.kind, interval);
}

std::string interval_text(const EventRow& event, const HistoryView& view) {
  const RunRow* good = find_run(view, event.good_run);
  const RunRow* bad = find_run(view, event.bad_run);
  if (good == nullptr || bad == nullptr) return fmt::format("before the nights looked at, on {}", event.machine);
  return fmt::format("between the nights of {} ({}) and {} ({}) on {}", day_of(*good), short_commit(good->build),
                     day_of(*bad), short_commit(bad->build), event.machine);
}

std::string verdict_text(const HistoryView& view, const TrackCheck& check) {
  const Coverage& coverage = check.coverage;
  std::vector<std::string> parts;
  const auto add = [&](std::string text) {
    if (!text.empty()) parts.push_back(std::move(text));
  };
  const auto is_of = [](const EventRow& e, const char* kind) { return is_open(e) && e.kind == kind; };
  const auto open_in = [&](EventState state) {
    return std::ranges::count_if(check.events, [&](const EventRow& e) {
      return is_in(e, state) && (is_of(e, event_kind::slower) || is_of(e, event_kind::drift));
    });
  };
  add(counted(open_in(EventState::confirmed), "regression", "regressions"));
  add(counted(open_in(EventState::suspect), "suspect", "suspects"));
  add(counted(std::ranges::count_if(check.events, [&](const EventRow& e) { return is_of(e, event_kind::errors); }),
              "change of errors", "changes of errors"));
  add(counted(std::ranges::count_if(check.events, [&](const EventRow& e) { return is_of(e, event_kind::lost); }),
              "loss of cases", "losses of cases"));
  const bool is_calm = parts.empty();
  if (is_calm)
    parts.push_back(coverage.nights_to_wait == 0
                        ? "no regression"
                        : fmt::format("too few nights to tell, {} more {} needed", coverage.nights_to_wait,
                                      coverage.nights_to_wait == 1 ? "is" : "are"));
  std::ptrdiff_t improvements = 0;
  for (std::size_t i = 0; i < check.events.size(); ++i)
    improvements += (check.events[i].kind == event_kind::faster && check.is_news[i] &&
                     !is_in(check.events[i], EventState::environment));
  add(counted(improvements, "improvement", "improvements"));
  std::set<std::string> machines;
  for (const RunRow& run : view.runs) machines.insert(run.machine);
  std::string text = fmt::format("{}; {} series on {}, {}", fmt::join(parts, ", "), coverage.looked_at,
                                 counted(static_cast<std::ptrdiff_t>(machines.size()), "machine", "machines"),
                                 counted(static_cast<std::ptrdiff_t>(view.runs.size()), "night", "nights"));
  if (coverage.waiting > 0)
    text += fmt::format("; {} series {} too few nights in the present environment to be compared", coverage.waiting,
                        coverage.waiting == 1 ? "has" : "have");
  if (coverage.gone > 0)
    text += fmt::format("; {} more {} no value since {}", coverage.gone, coverage.gone == 1 ? "has" : "have",
                        day_text(coverage.gone_unix_s));
  if (is_calm && coverage.nights_to_wait == 0 && check.case_shift > 0)
    text += fmt::format("; a step of {} in a case would be found within five nights", size_text_up(check.case_shift));
  return text;
}

std::string environment_text(const EnvironmentRow& row) {
  std::vector<std::string> parts;
  const json host = row.content.value("host", json::object());
  for (const char* key : {"os", "cpu"})
    if (const std::string text = host.value(key, ""); !text.empty()) parts.push_back(text);
  for (const json& device : row.content.value("devices", json::array()))
    parts.push_back(
        fmt::format("{} {} ({})", device.value("backend", ""), device.value("name", ""), device.value("driver", "")));
  return parts.empty() ? row.hash.substr(0, 8) : fmt::format("{}", fmt::join(parts, ", "));
}

json track_json(const HistoryView& view, const TrackCheck& check) {
  json events = json::array();
  for (std::size_t i = 0; i < check.events.size(); ++i) {
    const EventRow& event = check.events[i];
    json states = json::array();
    for (const EventStateRow& state : event.states)
      states.push_back({{"time", moment_text(state.unix_s)},
                        {"state", event_state_id(state.state)},
                        {"by", state.by},
                        {"text", state.text}});
    json names = json::array();
    for (const std::int64_t id : event.series)
      if (const auto series = std::ranges::find(view.series, id, &SeriesRow::id); series != view.series.end())
        names.push_back(series->case_id);
    json row = {{"id", event.id},
                {"state", event_state_id(event.states.back().state)},
                {"open", is_open(event)},
                {"news", static_cast<bool>(check.is_news[i])},
                {"kind", event.kind},
                {"what", event.what},
                {"machine", event.machine},
                {"good", run_json_of(view, event.good_run)},
                {"bad", run_json_of(view, event.bad_run)},
                {"q", event.q},
                {"cases", names},
                {"states", states}};
    if (has_size(event)) {
      row["effect"] = event.effect;
      row["interval"] = {event.low, event.high};
    }
    events.push_back(std::move(row));
  }
  return {{"verdict", verdict_text(view, check)},
          {"runs", view.runs.size()},
          {"series", check.coverage.looked_at},
          {"series_waiting", check.coverage.waiting},
          {"series_gone", check.coverage.gone},
          {"smallest_shift", check.case_shift},
          {"events", events}};
}

std::string track_markdown(const HistoryView& view, const TrackCheck& check) {
  std::string text = fmt::format("**reliefbench**: {}\n", markdown_escaped(verdict_text(view, check)));
  for (std::size_t i = 0; i < check.events.size(); ++i) {
    const EventRow& event = check.events[i];
    if (!is_open(event) && !check.is_news[i]) continue;
    text += fmt::format("\n- **{}**{} {} (event {})", event_state_id(event.states.back().state),
                        check.is_news[i] ? ", new:" : ":", markdown_escaped(event_line(event, view)), event.id);
  }
  return text.back() == '\n' ? text : text + "\n";
}

std::string track_junit(const HistoryView& view, const TrackCheck& check) {
  std::string cases;
  int failures = 0;
  int count = 0;
  for (const EventRow& event : check.events) {
    if (!is_open(event)) continue;
    ++failures;
    ++count;
    cases += fmt::format(
        "    <testcase classname=\"reliefbench.{}\" name=\"{}\">\n      <failure message=\"{}\"/>\n"
        "    </testcase>\n",
        xml_escaped(event.kind), xml_escaped(event.what), xml_escaped(event_line(event, view)));
  }
  if (count == 0) {
    count = 1;
    cases =
        fmt::format("    <testcase classname=\"reliefbench\" name=\"{}\"/>\n", xml_escaped(verdict_text(view, check)));
  }
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n  <testsuite name=\"reliefbench track\" tests=\"{}\" "
      "failures=\"{}\">\n{}  </testsuite>\n</testsuites>\n",
      count, failures, cases);
}

}  // namespace reliefbench
