#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "kernels/base/atomic_file.h"
#include "kernels/base/clock.h"
#include "kernels/base/console.h"
#include "reports/pages/trend_data.h"
#include "reports/pages/trend_page.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"
#include "tuner/decide/track_text.h"

namespace reliefbench {
namespace {

std::string painted_state(const EventRow& event, const Paint& paint) {
  const std::string_view id = event_state_id(event.states.back().state);
  if (is_open(event)) return paint.bad(id);
  return event.kind == event_kind::faster ? paint.good(id) : paint.dim(id);
}

/// The command that would settle an open event.
std::string next_command(const EventRow& event, const CheckArguments& arguments) {
  const std::string where = fmt::format("--db {} --event {}", shell_quoted(database_title(arguments.database)), event.id);
  const bool has_step = event.kind == event_kind::slower && event.states.back().state == EventState::suspect;
  return has_step ? fmt::format("reliefbench track confirm {} --good CMD --bad CMD", where)
                  : fmt::format("reliefbench track accept {}", where);
}

void print_event(const EventRow& event, bool is_news, const CheckedHistory& checked, const CheckArguments& arguments,
                 const Paint& paint) {
  put("{} {}{}: {}\n", painted_state(event, paint), is_news ? "(new) " : "", paint.bold(event.what), effect_text(event));
  const std::string& reason = event.states.back().text;
  put("  {}{}{}\n", interval_text(event, checked.view), event.q > 0 ? fmt::format("; q {:.2g}", event.q) : "",
      reason.empty() ? "" : "; " + reason);
  if (is_open(event)) put("  event {}, {} cases; next: {}\n", event.id, event.series.size(), next_command(event, arguments));
}

void print_answer(const CheckedHistory& checked, const CheckArguments& arguments) {
  const Paint paint = paint_for_stdout();
  for (std::size_t i = 0; i < checked.check.events.size(); ++i) {
    const EventRow& event = checked.check.events[i];
    const bool is_news = checked.check.is_news[i];
    if (is_news || (is_open(event) && !arguments.news)) print_event(event, is_news, checked, arguments, paint);
  }
  put("{}\n", verdict_text(checked.view, checked.check));
}

}  // namespace

EventOptions CheckArguments::options() const {
  if (!std::isfinite(least_effect) || least_effect < 0 || least_effect >= 1)
    fail_input("--least-effect {}: expected a share from 0 to 1, e.g. 0.015", least_effect);
  if (least_nights < 3) fail_input("--least-nights {}: expected at least 3", least_nights);
  EventOptions made;
  made.change.least_effect = least_effect;
  made.change.least_nights = least_nights;
  return made;
}

History::Query CheckArguments::query() const {
  History::Query query{.machine = machine};
  if (!since.empty()) query.since_unix_s = parse_time(since, "--since");
  return query;
}

void add_check_options(CLI::App& command, CheckArguments& arguments) {
  command.add_option("--since", arguments.since, "look at nights from then on only")->type_name("TIME");
  command.add_option("--machine", arguments.machine, "look at this machine only")->type_name("NAME");
  command.add_option("--least-effect", arguments.least_effect, "a step matters where its interval excludes this share")
      ->type_name("SHARE")
      ->capture_default_str();
  command.add_option("--least-nights", arguments.least_nights, "nights that a new level takes to be one")
      ->type_name("N")
      ->capture_default_str();
  command.add_flag("--news", arguments.news, "tell, and exit 1 for, only what no earlier check told: for a mail");
}

void add_check_outputs(CLI::App& command, CheckOutput& output) {
  CLI::Option* json = command.add_flag("--json", output.json, "as JSON");
  command.add_flag("--markdown", output.markdown, "as Markdown, for a comment")->excludes(json);
  command.add_option("--junit", output.junit, "write JUnit XML to a file, too")->type_name("FILE");
}

CheckedHistory checked_history(History& history, const CheckArguments& arguments) {
  CheckedHistory checked;
  checked.view = history.load(arguments.query());
  checked.check = check_history(checked.view, arguments.options(), static_cast<std::int64_t>(unix_ns() / 1e9));
  history.add_events(news_of(checked.check));
  // The new ones have their ids now.
  const std::vector<EventRow> stored = history.load(arguments.query()).events;
  for (EventRow& event : checked.check.events)
    if (event.id == 0)
      if (const auto found = std::ranges::find(stored, event.key, &EventRow::key); found != stored.end())
        event.id = found->id;
  return checked;
}

Exit print_check(const CheckedHistory& checked, const CheckArguments& arguments, const CheckOutput& output) {
  if (!output.junit.empty()) write_output(output.junit, track_junit(checked.view, checked.check));
  if (output.json)
    fmt::print("{}\n", track_json(checked.view, checked.check).dump(2));
  else if (output.markdown)
    fmt::print("{}", track_markdown(checked.view, checked.check));
  else
    print_answer(checked, arguments);
  const Exit result = exit_of(checked.check, checked.view, arguments.news);
  if (result == Exit::nothing_measured)
    print_error(fmt::format("{}: no night to look at; `reliefbench track ingest` adds them",
                            database_title(arguments.database)));
  return result;
}

void write_trend_page(const CheckedHistory& checked, const CheckArguments& arguments, const std::string& file) {
  const std::string title = database_title(arguments.database);
  write_output(file, trend_page(trend_data_json(checked.view, checked.check, arguments.options(), title)));
}

void add_track_check(CLI::App& track, int& exit_code) {
  CLI::App* command = track.add_subcommand("check", "what moved, since which commits, by how much, how sure");
  const auto arguments = std::make_shared<CheckArguments>();
  const auto output = std::make_shared<CheckOutput>();
  add_database_option(*command, arguments->database);
  add_check_options(*command, *arguments);
  add_check_outputs(*command, *output);
  command->footer(
      "A step is suspect when it is new, and confirmed by further nights or by `track confirm`. Cases that move together\n"
      "are one event. Exit code 1 where a regression is open, 5 where there is no night.\n"
      "Example:\n  reliefbench track check --db nightly.sqlite --markdown");
  command->callback([=, &exit_code] {
    History history(arguments->database, History::Access::write);
    exit_code = static_cast<int>(print_check(checked_history(history, *arguments), *arguments, *output));
  });
}

}  // namespace reliefbench
