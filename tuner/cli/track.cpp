#include "tuner/cli/track.h"

#include "tuner/cli/commands.h"
#include "tuner/cli/options.h"
#include "tuner/history/moment.h"

namespace reliefbench {

CLI::Option* add_database_option(CLI::App& command) {
  return command.add_option("--db", "the history: a file (SQLite), or postgresql://[user[:password]@][host]/database")
      ->type_name("DATABASE")
      ->required();
}

NightOptions add_night_options(CLI::App& command) {
  return {.machine = command.add_option("--machine", "only its nights")->type_name("NAME"),
          .since = command.add_option("--since", "only nights from then on: 2026-11-22T12:00:00Z or @1795348800")
                       ->type_name("TIME")};
}

History::Query NightOptions::query() const {
  History::Query query{.machine = value_or(machine, std::string())};
  if (!since->empty()) query.since_unix_s = parse_moment(since->as<std::string>(), "--since");
  return query;
}

void add_track_command(CLI::App& app, int& exit_code) {
  CLI::App* track = app.add_subcommand("track", "the history of nightly runs, and what changed in it");
  track->require_subcommand(1);
  track->footer(
      "A history is a database that nights are imported into: runs' folders, and the JSON of any Google Benchmark. "
      "The\n"
      "folders stay the source; a history can be made anew from them at any time. Its rows are appended, never "
      "altered.\n"
      "Example:\n  reliefbench track ingest out/night --db history.db\n  reliefbench track list runs --db history.db");
  add_track_ingest(*track, exit_code);
  add_track_list(*track, exit_code);
  add_track_annotate(*track, exit_code);
  add_track_export(*track, exit_code);
}

}  // namespace reliefbench
