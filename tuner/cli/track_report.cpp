#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"

namespace reliefbench {

void add_track_report(CLI::App& track, int& exit_code) {
  CLI::App* command = track.add_subcommand("report", "write the trend page: one offline HTML file");
  const CLI::Option* database = add_database_option(*command);
  const CLI::Option* output = command->add_option("-o,--output", "HTML file")->required();
  const NightOptions nights = add_night_options(*command);
  const CheckOptions options = add_check_options(*command);
  command->footer("Example:\n  reliefbench track report --db history.db -o trend.html");
  command->callback([=, &exit_code] {
    const CheckArguments arguments = options.arguments(database, nights.query());
    const auto file = output->as<std::string>();
    write_trend_page(checked_history(arguments), arguments, file);
    put("{}\n", file);
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
