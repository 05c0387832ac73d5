#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <set>

#include "kernels/base/console.h"
#include "tuner/cli/format.h"
#include "tuner/cli/names.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"
#include "tuner/history/moment.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// How many series a run has, and in how many it has a valid value.
struct RunCount {
  std::size_t series = 0;
  std::size_t valid = 0;
};

std::map<std::int64_t, RunCount> counts_of(const HistoryView& view) {
  std::map<std::int64_t, RunCount> counts;
  for (const std::vector<RepetitionRow>& nights : view.nights)
    for (const RepetitionRow& row : nights) {
      ++counts[row.run].series;
      if (row.is_valid) ++counts[row.run].valid;
    }
  return counts;
}

json annotations_of(const HistoryView& view, std::int64_t AnnotationRow::*what, std::int64_t id) {
  json list = json::array();
  for (const AnnotationRow& row : view.annotations)
    if (row.*what == id) list.push_back({{"time", moment_text(row.unix_s)}, {"by", row.by}, {"text", row.text}});
  return list;
}

json runs_json(const HistoryView& view) {
  const std::map<std::int64_t, RunCount> counts = counts_of(view);
  json list = json::array();
  for (const RunRow& run : view.runs) {
    const auto found = counts.find(run.id);
    const RunCount count = found == counts.end() ? RunCount() : found->second;
    json calibrations = json::array();
    for (const CalibrationRow& row : run.calibrations)
      calibrations.push_back({{"device", row.device}, {"control_ns", row.control_ns}, {"mad", row.mad}, {"n", row.n}});
    list.push_back({{"run", run.id},
                    {"time", moment_text(run.unix_s)},
                    {"unix_s", run.unix_s},
                    {"machine", run.machine},
                    {"kind", run.kind},
                    {"commit", run.build.commit},
                    {"parent", run.build.parent},
                    {"dirty", run.build.is_dirty},
                    {"environment", run.environment},
                    {"series", count.series},
                    {"valid", count.valid},
                    {"source", run.source},
                    {"calibrations", calibrations},
                    {"annotations", annotations_of(view, &AnnotationRow::run, run.id)}});
  }
  return list;
}

json series_json(const HistoryView& view) {
  json list = json::array();
  for (std::size_t i = 0; i < view.series.size(); ++i) {
    const SeriesRow& row = view.series[i];
    const auto last = std::ranges::find(view.nights[i].rbegin(), view.nights[i].rend(), true, &RepetitionRow::is_valid);
    list.push_back({{"series", row.id},
                    {"machine", row.machine},
                    {"case", row.case_id},
                    {"setting", row.setting},
                    {"device", row.device},
                    {"metric", row.metric},
                    {"unit", row.unit},
                    {"lower_is_better", row.lower_is_better},
                    {"nights", view.nights[i].size()},
                    {"valid", std::ranges::count(view.nights[i], true, &RepetitionRow::is_valid)},
                    {"last_median", last == view.nights[i].rend() ? json() : json(last->median)},
                    {"last_value", last == view.nights[i].rend() ? json() : json(last->value)}});
  }
  return list;
}

json events_json(const HistoryView& view) {
  json list = json::array();
  for (const EventRow& row : view.events) {
    json states = json::array();
    for (const EventStateRow& state : row.states)
      states.push_back({{"time", moment_text(state.unix_s)},
                        {"state", event_state_id(state.state)},
                        {"by", state.by},
                        {"text", state.text}});
    list.push_back({{"event", row.id},
                    {"state", row.states.empty() ? json() : json(event_state_id(row.states.back().state))},
                    {"machine", row.machine},
                    {"kind", row.kind},
                    {"what", row.what},
                    {"good_run", row.good_run},
                    {"bad_run", row.bad_run},
                    {"effect", row.effect},
                    {"low", row.low},
                    {"high", row.high},
                    {"q", row.q},
                    {"series", row.series},
                    {"states", states},
                    {"annotations", annotations_of(view, &AnnotationRow::event, row.id)}});
  }
  return list;
}

json machines_json(const HistoryView& view) {
  std::map<std::string, std::vector<const RunRow*>> machines;
  for (const RunRow& run : view.runs) machines[run.machine].push_back(&run);
  json list = json::array();
  for (const auto& [name, runs] : machines) {
    std::set<std::int64_t> environments;
    for (const RunRow* run : runs) environments.insert(run->environment);
    list.push_back({{"machine", name},
                    {"runs", runs.size()},
                    {"environments", environments.size()},
                    {"first", moment_text(runs.front()->unix_s)},
                    {"last", moment_text(runs.back()->unix_s)}});
  }
  return list;
}

/// A cell of what people read, of a key of a row.
std::string cell_of(const json& row, const std::string& key) {
  const auto found = row.find(key);
  if (found == row.end() || found->is_null()) return "";
  if (found->is_string()) return one_line(found->get<std::string>());
  if (found->is_array()) return fmt::format("{}", found->size());
  return found->is_number_float() ? format_number(found->get<double>()) : found->dump();
}

std::string case_text(const std::string& case_id) {
  try {
    return one_line(Names().whole_case(case_id));
  } catch (const Error&) {  // a benchmark's name
    return one_line(case_id);
  }
}

std::string run_note(const json& run) {
  std::string note = run["dirty"] == true ? "changed sources" : "";
  for (const json& annotation : run["annotations"])
    note += (note.empty() ? "" : "; ") + one_line(annotation["text"].get<std::string>());
  return note;
}

std::string interval_text(const json& event) {
  const auto percent = [&](const char* key) { return 100 * event[key].get<double>(); };
  return fmt::format("{:+.1f} % [{:+.1f}, {:+.1f}]", percent("effect"), percent("low"), percent("high"));
}

/// A column of a list: its title, and what stands there of a row.
struct ListColumn {
  std::string title;
  std::function<std::string(const json&)> cell;
};
ListColumn plain(const std::string& key) {
  return {key, [key](const json& row) { return cell_of(row, key); }};
}

/// What can be listed.
struct Listing {
  std::string id;
  json (*rows)(const HistoryView& view);
  std::vector<ListColumn> columns;
};

const std::vector<Listing>& listings() {
  static const std::vector<Listing> all = {
      {"runs",
       runs_json,
       {plain("run"),
        plain("time"),
        plain("machine"),
        {"commit", [](const json& run) { return cell_of(run, "commit").substr(0, 12); }},
        plain("environment"),
        {"valid", [](const json& run) { return cell_of(run, "valid") + "/" + cell_of(run, "series"); }},
        plain("source"),
        {"note", run_note}}},
      {"series",
       series_json,
       {plain("series"),
        plain("machine"),
        plain("metric"),
        plain("nights"),
        {"last", [](const json& series) { return cell_of(series, "last_median") + " " + cell_of(series, "unit"); }},
        {"case", [](const json& series) { return case_text(series["case"]); }}}},
      {"events",
       events_json,
       {plain("event"),
        plain("state"),
        plain("kind"),
        {"effect", interval_text},
        {"runs", [](const json& event) { return cell_of(event, "good_run") + ".." + cell_of(event, "bad_run"); }},
        plain("series"),
        plain("machine"),
        plain("what")}},
      {"machines",
       machines_json,
       {plain("machine"), plain("runs"), plain("environments"), plain("first"), plain("last")}}};
  return all;
}

void print_listing(const Listing& listing, const json& rows) {
  std::vector<std::vector<std::string>> table(1);
  for (const ListColumn& column : listing.columns) table.front().push_back(column.title);
  for (const json& row : rows) {
    table.emplace_back();
    for (const ListColumn& column : listing.columns) table.back().push_back(column.cell(row));
  }
  if (rows.empty()) return put("no {}\n", listing.id);
  put("{}", columns(table));
}

struct HistoryList {
  std::string what = "runs";
  std::string database;
  History::Query query;
  bool json = false;
};

void list_history(const HistoryList& arguments) {
  const Listing& listing = *std::ranges::find(listings(), arguments.what, &Listing::id);
  const History history(arguments.database, History::Access::read);
  const json rows = listing.rows(history.load(arguments.query));
  if (arguments.json)
    print_json(rows, 2);
  else
    print_listing(listing, rows);
}

}  // namespace

void add_track_list(CLI::App& track, Exit& /*exit_code*/) {
  CLI::App* command = track.add_subcommand("list", "what a history holds");
  const auto arguments = std::make_shared<HistoryList>();
  std::vector<std::string> ids;
  for (const Listing& listing : listings()) ids.push_back(listing.id);
  command->add_option("WHAT", arguments->what, fmt::format("{}; runs", fmt::join(ids, " | ")))
      ->check(CLI::IsMember(ids));
  add_database_option(*command, arguments->database);
  add_night_options(*command, arguments->query);
  add_json_option(*command, arguments->json);
  command->footer("Example:\n  reliefbench track list runs --db history.db");
  command->callback([arguments] { list_history(*arguments); });
}

}  // namespace reliefbench
