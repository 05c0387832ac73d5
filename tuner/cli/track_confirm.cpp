#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "kernels/base/sha256.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/rerun.h"
#include "tuner/cli/track.h"
#include "tuner/decide/confirm.h"
#include "tuner/decide/track_text.h"
#include "tuner/history/moment.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

struct ConfirmArguments {
  std::string database;
  std::int64_t event = 0;  ///< 0: the only open step
  std::string good;
  std::string bad;
  int rounds = 3;
  fs::path output;  ///< "": folder_of()
  bool quiet = false;
  bool json = false;
};

bool is_step(const EventRow& event) { return event.kind == event_kind::slower || event.kind == event_kind::faster; }

/// The event of that id, or the only open step. throws: Error(bad_input)
EventRow event_to_settle(const HistoryView& view, std::int64_t id) {
  if (id != 0) return find_event(view, id);
  std::vector<std::int64_t> open;
  for (const EventRow& event : view.events)
    if (is_open(event) && is_step(event)) open.push_back(event.id);
  if (open.size() == 1) return find_event(view, open.front());
  if (open.empty()) fail_input("no step is open; `reliefbench track check` looks for them");
  fail_input("several steps are open, say which by --event: {}", fmt::join(open, ", "));
}

/// Where an event is re-run without -o: by its number, and by all that makes it another re-run. Another history's event
/// may have its number, and another command measures another build.
fs::path folder_of(const EventRow& event, const HistoryView& view, const ConfirmArguments& arguments) {
  std::string text = fmt::format("{}\n{}\n{}", event.key, arguments.good, arguments.bad);
  for (const RunRow& run : view.runs)
    if (run.id == event.good_run || run.id == event.bad_run) text += '\n' + run.content;
  return fs::path("out/confirm") / fmt::format("{}-{}", event.id, sha256(text).substr(0, 8));
}

std::string answer_text(const RerunAnswer& answer, const EventRow& event) {
  const auto share = [](double log) { return 100 * std::expm1(log); };
  return fmt::format("re-run: {:+.1f} % [{:+.1f}, {:+.1f}] over {} cases, in the history {:+.1f} %",
                     share(answer.log_ratio), share(answer.low), share(answer.high), answer.series, 100 * event.effect);
}

nlohmann::json answer_json(const RerunAnswer& answer, const EventRow& event) {
  return {{"event", event.id},
          {"what", event.what},
          {"state", answer.state ? nlohmann::json(event_state_id(*answer.state)) : nlohmann::json(nullptr)},
          {"effect", std::expm1(answer.log_ratio)},
          {"interval", {std::expm1(answer.low), std::expm1(answer.high)}},
          {"cases", answer.series}};
}

Exit exit_of(const RerunAnswer& answer, const EventRow& event) {
  if (!answer.state) return Exit::inconclusive;
  return *answer.state == EventState::confirmed && event.kind == event_kind::slower ? Exit::answer_is_no : Exit::done;
}

Exit confirm_command(ConfirmArguments arguments) {
  History history = History::existing(arguments.database);
  const HistoryView view = history.load({});
  EventRow event = event_to_settle(view, arguments.event);
  if (arguments.output.empty()) arguments.output = folder_of(event, view, arguments);
  if (!is_step(event))
    fail_input("--event {} is of the kind '{}': a re-run settles steps of a time only", event.id, event.kind);
  std::set<std::string> keys;
  for (const SeriesRow& series : view.series)
    if (std::ranges::find(event.series, series.id) != event.series.end()) keys.insert(rerun_key(series));
  const RerunAnswer answer =
      judge_reruns(rerun_in_turns({.first = {.name = "good", .label = "the good build", .command = arguments.good},
                                   .second = {.name = "bad", .label = "the suspect build", .command = arguments.bad},
                                   .rounds = arguments.rounds,
                                   .output = arguments.output,
                                   .quiet = arguments.quiet},
                                  keys),
                   std::log1p(event.effect));
  const std::string text = answer_text(answer, event);
  if (answer.state && event.states.back().state != *answer.state) {
    event.states.push_back({.unix_s = moment_now(), .state = *answer.state, .by = "confirm", .text = text});
    history.add_events({&event, 1});
  }
  if (arguments.json)
    print_json(answer_json(answer, event), 2);
  else
    put("{} {}: {}\n", answer.state ? event_state_id(*answer.state) : "inconclusive", event.what, text);
  return exit_of(answer, event);
}

}  // namespace

void add_track_confirm(CLI::App& track, Exit& exit_code) {
  CLI::App* command =
      track.add_subcommand("confirm", "measure the last good build and the suspect one again, in turns");
  const auto arguments = std::make_shared<ConfirmArguments>();
  add_database_option(*command, arguments->database);
  command->add_option("--event", arguments->event, "its number, as `track check` prints it; the only open step")
      ->type_name("N");
  command->add_option("--good", arguments->good, "shell command that measures the good build into $OUT")
      ->type_name("CMD")
      ->required();
  command->add_option("--bad", arguments->bad, "... and the suspect one")->type_name("CMD")->required();
  add_rounds_option(*command, arguments->rounds, "of good, bad, bad, good");
  command
      ->add_option("-o,--output", arguments->output,
                   "folder of the re-runs; those that are there count, so that a killed one goes on. Default: "
                   "out/confirm/EVENT-KEY, of this event and these commands")
      ->type_name("DIR");
  add_quiet_option(*command, arguments->quiet);
  add_json_option(*command, arguments->json);
  command->footer(
      "What the commands leave at $OUT is a run's folder or a file of Google Benchmark. Exit code 1 where a regression "
      "is\n"
      "confirmed, 0 where it is cleared, 4 where the interval is too wide for either: then ask for more rounds.\n"
      "Example:\n  reliefbench track confirm --db history.db --event 3 \\\n"
      "    --good 'good/reliefbench sweep nightly.json --quiet -o $OUT' \\\n"
      "    --bad 'bad/reliefbench sweep nightly.json --quiet -o $OUT'");
  command->callback([arguments, &exit_code] { exit_code = confirm_command(*arguments); });
}

}  // namespace reliefbench
