#include <cstdlib>
#include <memory>

#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"
#include "tuner/history/moment.h"

namespace reliefbench {
namespace {

struct AnnotateArguments {
  std::string database;
  AnnotationRow annotation{.by = user_name(), .text = {}};
};

}  // namespace

std::string user_name() {
  for (const char* variable : {"USER", "LOGNAME"})
    if (const char* name = std::getenv(variable); name != nullptr && *name != '\0') return name;
  return "unknown";
}

void add_track_annotate(CLI::App& track, Exit& /*exit_code*/) {
  CLI::App* command = track.add_subcommand("annotate", "say something of a run or an event, for all who look later");
  const auto arguments = std::make_shared<AnnotateArguments>();
  AnnotationRow& row = arguments->annotation;
  add_database_option(*command, arguments->database);
  CLI::Option* run = command->add_option("--run", row.run, "its number in `track list runs`")->type_name("N");
  command->add_option("--event", row.event, "its number in `track list events`")->type_name("N")->excludes(run);
  command->add_option("--text", row.text, "what there is to say")->required();
  command->add_option("--by", row.by, "who says so; you")->type_name("NAME");
  command->footer(
      "Example:\n  reliefbench track annotate --db history.db --run 17 --text 'new kernel since this night'");
  command->callback([arguments] {
    AnnotationRow& annotation = arguments->annotation;
    if (annotation.run < 1 && annotation.event < 1) fail_input("annotate: expected --run N or --event N, from 1");
    if (annotation.text.empty()) fail_input("--text: is empty");
    annotation.unix_s = moment_now();
    History::existing(arguments->database).annotate(annotation);
    put("noted\n");
  });
}

}  // namespace reliefbench
