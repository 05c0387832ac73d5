#include <memory>

#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"

namespace reliefbench {
namespace {

struct TrendArguments {
  CheckArguments check;
  std::string output;
};

}  // namespace

void add_track_report(CLI::App& track, Exit& /*exit_code*/) {
  CLI::App* command = track.add_subcommand("report", "write the trend page: one offline HTML file");
  const auto arguments = std::make_shared<TrendArguments>();
  add_database_option(*command, arguments->check.database);
  command->add_option("-o,--output", arguments->output, "HTML file")->required();
  add_night_options(*command, arguments->check.query);
  add_check_options(*command, arguments->check);
  command->footer("Example:\n  reliefbench track report --db history.db -o trend.html");
  command->callback([arguments] {
    write_trend_page(checked_history(arguments->check), arguments->check, arguments->output);
    put("{}\n", arguments->output);
  });
}

}  // namespace reliefbench
