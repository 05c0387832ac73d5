#include <cstdlib>

#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"
#include "tuner/history/moment.h"

namespace reliefbench {
namespace {

std::string user_name() {
  for (const char* variable : {"USER", "LOGNAME"})
    if (const char* name = std::getenv(variable); name != nullptr && *name != '\0') return name;
  return "unknown";
}

}  // namespace

std::string author(const CLI::Option* by) { return value_or(by, user_name()); }

void add_track_annotate(CLI::App& track, int& exit_code) {
  CLI::App* command = track.add_subcommand("annotate", "say something of a run or an event, for all who look later");
  const CLI::Option* database = add_database_option(*command);
  CLI::Option* run = command->add_option("--run", "its number in `track list runs`")->type_name("N");
  CLI::Option* event = command->add_option("--event", "its number in `track list events`")->type_name("N");
  run->excludes(event);
  const CLI::Option* text = command->add_option("--text", "what there is to say")->required();
  const CLI::Option* by = command->add_option("--by", "who says so; you")->type_name("NAME");
  command->footer(
      "Example:\n  reliefbench track annotate --db history.db --run 17 --text 'new kernel since this night'");
  command->callback([=, &exit_code] {
    const AnnotationRow annotation{.run = value_or(run, std::int64_t{0}),
                                   .event = value_or(event, std::int64_t{0}),
                                   .unix_s = moment_now(),
                                   .by = author(by),
                                   .text = text->as<std::string>()};
    if (annotation.run < 1 && annotation.event < 1) fail_input("annotate: expected --run N or --event N, from 1");
    if (annotation.text.empty()) fail_input("--text: is empty");
    History::existing(database->as<std::string>()).annotate(annotation);
    put("noted\n");
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
