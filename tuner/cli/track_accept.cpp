#include <fmt/format.h>

#include <cstdlib>

#include "kernels/base/clock.h"
#include "tuner/cli/format.h"
#include "tuner/cli/track.h"
#include "tuner/decide/track_text.h"

namespace reliefbench {
namespace {

struct AcceptArguments {
  std::string database;
  std::int64_t event = 0;
  std::string by;
  std::string text;
};

std::string user_name() {
  const char* const name = std::getenv("USER");
  return name == nullptr ? "somebody" : name;
}

void accept_command(const AcceptArguments& arguments) {
  History history(arguments.database, History::Access::write);
  const HistoryView view = history.load({});
  EventRow event = find_event(view, arguments.event);
  if (event.states.back().state == EventState::accepted) {
    put("event {} is accepted already\n", event.id);
    return;
  }
  event.states.push_back({.unix_s = static_cast<std::int64_t>(unix_ns() / 1e9),
                          .state = EventState::accepted,
                          .by = arguments.by.empty() ? user_name() : arguments.by,
                          .text = arguments.text});
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

void add_track_accept(CLI::App& track, int& exit_code) {
  CLI::App* command = track.add_subcommand("accept", "take an event's new level for the base");
  const auto arguments = std::make_shared<AcceptArguments>();
  add_database_option(*command, arguments->database);
  command->add_option("--event", arguments->event, "its number, as `track check` prints it")->required();
  command->add_option("--by", arguments->by, "who accepts it; default: $USER")->type_name("NAME");
  command->add_option("--text", arguments->text, "why")->type_name("TEXT");
  command->footer(
      "Example:\n  reliefbench track accept --db nightly.sqlite --event 3 --text 'more exact, worth 5 %'");
  command->callback([=, &exit_code] {
    accept_command(*arguments);
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
