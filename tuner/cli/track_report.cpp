#include "tuner/cli/format.h"
#include "tuner/cli/track.h"

namespace reliefbench {

void add_track_report(CLI::App& track, int& exit_code) {
  CLI::App* command = track.add_subcommand("report", "write the trend page: one offline HTML file");
  const auto arguments = std::make_shared<CheckArguments>();
  const auto output = std::make_shared<std::string>();
  add_database_option(*command, arguments->database);
  command->add_option("-o,--output", *output, "HTML file")->required();
  add_check_options(*command, *arguments);
  command->footer("Example:\n  reliefbench track report --db nightly.sqlite -o trend.html");
  command->callback([=, &exit_code] {
    History history(arguments->database, History::Access::write);
    write_trend_page(checked_history(history, *arguments), *arguments, *output);
    put("{}\n", *output);
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
