#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "kernels/base/atomic_file.h"
#include "kernels/base/console.h"
#include "reports/pages/trend_data.h"
#include "reports/pages/trend_page.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"
#include "tuner/decide/track_text.h"
#include "tuner/history/moment.h"

namespace reliefbench {
namespace {

std::string painted_state(const EventRow& event, const Paint& paint) {
  const std::string_view id = event_state_id(event.states.back().state);
  if (is_open(event)) return paint.bad(id);
  return event.kind == event_kind::faster ? paint.good(id) : paint.dim(id);
}

/// The command that would settle an open event.
std::string next_command(const EventRow& event, const std::string& title) {
  const std::string where = fmt::format("--db {} --event {}", shell_quoted(title), event.id);
  const bool has_step = event.kind == event_kind::slower && event.states.back().state == EventState::suspect;
  return has_step ? fmt::format("reliefbench track confirm {} --good CMD --bad CMD", where)
                  : fmt::format("reliefbench track accept {}", where);
}

void print_event(const EventRow& event, bool is_news, const CheckedHistory& checked, const Paint& paint) {
  put("{} {}{}: {}\n", painted_state(event, paint), is_news ? "(new) " : "", paint.bold(event.what),
      effect_text(event));
  const std::string& reason = event.states.back().text;
  put("  {}{}{}\n", interval_text(event, checked.view), event.q > 0 ? fmt::format("; q {:.2g}", event.q) : "",
      reason.empty() ? "" : "; " + reason);
  if (is_open(event))
    put("  event {}, {} cases; next: {}\n", event.id, event.series.size(), next_command(event, checked.title));
}

void print_answer(const CheckedHistory& checked, const CheckArguments& arguments) {
  const Paint paint = paint_for_stdout();
  for (std::size_t i = 0; i < checked.check.events.size(); ++i) {
    const EventRow& event = checked.check.events[i];
    const bool is_news = checked.check.is_news[i];
    if (is_news || (is_open(event) && !arguments.news_only)) print_event(event, is_news, checked, paint);
  }
  put("{}\n", verdict_text(checked.view, checked.check));
}

}  // namespace

void add_check_options(CLI::App& command, CheckArguments& arguments) {
  ChangeOptions& change = arguments.options.change;
  const std::size_t least = change.least_nights;
  CLI::Option* json = add_json_option(command, arguments.json);
  command
      .add_option("--least-effect", change.least_effect,
                  fmt::format("a step matters where its interval excludes this share; {}", change.least_effect))
      ->type_name("SHARE")
      ->check(expect_number("a share from 0 to 1, e.g. 0.015", [](double share) { return share >= 0 && share < 1; }));
  command
      .add_option("--least-nights", change.least_nights,
                  fmt::format("nights that a new level takes to be one; {}", least))
      ->type_name("N")
      ->check(expect_number(fmt::format("at least {}", least),
                            [least](double nights) { return nights >= static_cast<double>(least); }));
  command.add_flag("--news", arguments.news_only, "tell, and exit 1 for, only what no earlier check told: for a mail");
  command.add_flag("--markdown", arguments.markdown, "as Markdown, for a comment")->excludes(json);
  command.add_option("--junit", arguments.junit, "write JUnit XML to a file, too")->type_name("FILE");
}

CheckedHistory checked_history(const CheckArguments& arguments) {
  History history = History::existing(arguments.database);
  CheckedHistory checked{.title = history.name(), .view = {}, .check = {}};
  checked.view = history.load(arguments.query);
  checked.check = check_history(checked.view, arguments.options, moment_now());
  const std::vector<std::int64_t> ids = history.add_events(news_of(checked.check));
  auto id = ids.begin();
  for (std::size_t i = 0; i < checked.check.events.size(); ++i)
    if (checked.check.is_news[i]) checked.check.events[i].id = *id++;
  return checked;
}

Exit print_check(const CheckedHistory& checked, const CheckArguments& arguments) {
  if (!arguments.junit.empty()) write_output(arguments.junit, track_junit(checked.view, checked.check));
  if (arguments.json)
    print_json(track_json(checked.view, checked.check), 2);
  else if (arguments.markdown)
    fmt::print("{}", track_markdown(checked.view, checked.check));
  else
    print_answer(checked, arguments);
  const Exit result = exit_of(checked.check, checked.view, arguments.news_only);
  if (result == Exit::nothing_measured) print_error("no night to look at; `reliefbench track ingest` adds them");
  return result;
}

void write_trend_page(const CheckedHistory& checked, const CheckArguments& arguments, const std::string& file) {
  write_output(file, trend_page(trend_data_json(checked.view, checked.check, arguments.options, checked.title)));
}

void add_track_check(CLI::App& track, Exit& exit_code) {
  CLI::App* command = track.add_subcommand("check", "what moved, since which commits, by how much, how sure");
  const auto arguments = std::make_shared<CheckArguments>();
  add_database_option(*command, arguments->database);
  add_night_options(*command, arguments->query);
  add_check_options(*command, *arguments);
  command->footer(
      "A step is suspect when it is new, and confirmed by further nights or by `track confirm`. Cases that move "
      "together\n"
      "are one event. Exit code 1 where a regression is open, 5 where there is no night. A check of fewer nights "
      "(--since)\n"
      "or for larger steps leaves open what it could not see.\n"
      "Example:\n  reliefbench track check --db history.db --markdown");
  command->callback([arguments, &exit_code] { exit_code = print_check(checked_history(*arguments), *arguments); });
}

}  // namespace reliefbench
