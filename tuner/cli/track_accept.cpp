#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"
#include "tuner/decide/track_text.h"
#include "tuner/history/moment.h"

namespace reliefbench {
namespace {

struct AcceptArguments {
  std::string database;
  std::int64_t event = 0;
  EventStateRow state{.unix_s = 0, .state = EventState::accepted, .by = user_name(), .text = {}};
};

void accept_event(const std::string& database, std::int64_t id, const EventStateRow& state) {
  History history = History::existing(database);
  const HistoryView view = history.load({});
  const EventRow& known = find_event(view, id);
  if (known.states.back().state == EventState::accepted) {
    put("event {} is accepted already\n", known.id);
    return;
  }
  // Of the size and the cases that it has by now, which the check that told of it may not have seen.
  const TrackCheck check = check_history(view, {}, state.unix_s);
  EventRow event = *std::ranges::find(check.events, id, &EventRow::id);
  if (event.states.back().state == EventState::recovered) {
    put("event {} is over: {}\n", event.id, event.states.back().text);
    return;
  }
  event.states = known.states;
  event.states.push_back(state);
  history.add_events({&event, 1});
  put("accepted: {}, {}; the new level is the base from now on\n", event.what, effect_text(event));
}

}  // namespace

const EventRow& find_event(const HistoryView& view, std::int64_t id) {
  const auto found = std::ranges::find(view.events, id, &EventRow::id);
  if (found != view.events.end()) return *found;
  std::vector<std::int64_t> open;
  for (const EventRow& event : view.events)
    if (is_open(event)) open.push_back(event.id);
  if (open.empty()) fail_input("--event {}: there is none, and no other is open", id);
  fail_input("--event {}: there is none; open are {}", id, fmt::join(open, ", "));
}

void add_track_accept(CLI::App& track, Exit& /*exit_code*/) {
  CLI::App* command = track.add_subcommand("accept", "take an event's new level for the base");
  const auto arguments = std::make_shared<AcceptArguments>();
  add_database_option(*command, arguments->database);
  command->add_option("--event", arguments->event, "its number, as `track check` prints it")
      ->type_name("N")
      ->required();
  command->add_option("--by", arguments->state.by, "who accepts it; you")->type_name("NAME");
  command->add_option("--text", arguments->state.text, "why");
  command->footer("Example:\n  reliefbench track accept --db history.db --event 3 --text 'more exact, worth 5 %'");
  command->callback([arguments] {
    arguments->state.unix_s = moment_now();
    accept_event(arguments->database, arguments->event, arguments->state);
  });
}

}  // namespace reliefbench
