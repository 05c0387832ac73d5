#include "tuner/cli/track.h"

#include "tuner/cli/commands.h"
#include "tuner/cli/options.h"
#include "tuner/history/moment.h"

namespace reliefbench {

void add_database_option(CLI::App& command, std::string& database) {
  command
      .add_option("--db", database, "the history: a file (SQLite), or postgresql://[user[:password]@][host]/database")
      ->type_name("DATABASE")
      ->required();
}

void add_night_options(CLI::App& command, History::Query& nights) {
  command.add_option("--machine", nights.machine, "only its nights")->type_name("NAME");
  const auto read = [&nights](const std::string& text) { nights.since_unix_s = parse_moment(text, "--since"); };
  command
      .add_option_function<std::string>("--since", read,
                                        "only nights from then on: 2026-11-22T12:00:00Z or @1795348800")
      ->type_name("TIME");
}

void add_label_options(CLI::App& command, NightLabels& labels) {
  command.add_option("--commit", labels.commit, "what was measured; the commit that reliefbench was built from")
      ->type_name("SHA");
  command.add_option("--parent", labels.parent, "the commit before it")->type_name("SHA");
  const auto read = [&labels](const std::string& text) { labels.unix_s = parse_moment(text, "--time"); };
  command
      .add_option_function<std::string>("--time", read, "2026-11-22T12:00:00Z or @1795348800; when the run was started")
      ->type_name("TIME");
  command.add_option("--machine", labels.machine, "what it was measured on; the name of the run's host")
      ->type_name("NAME");
}

void add_track_command(CLI::App& app, Exit& exit_code) {
  CLI::App* track = app.add_subcommand("track", "the history of nightly runs, and what changed in it");
  track->require_subcommand(1);
  track->footer(
      "A history is a database that nights are imported into: runs' folders, and the JSON of any Google Benchmark. "
      "The\n"
      "folders stay the source; a history can be made anew from them at any time. Its rows are appended, never "
      "altered.\n"
      "Example:\n  reliefbench track ingest out/night --db history.db\n  reliefbench track check --db history.db");
  add_track_night(*track, exit_code);
  add_track_ingest(*track, exit_code);
  add_track_check(*track, exit_code);
  add_track_report(*track, exit_code);
  add_track_confirm(*track, exit_code);
  add_track_accept(*track, exit_code);
  add_track_annotate(*track, exit_code);
  add_track_list(*track, exit_code);
  add_track_export(*track, exit_code);
}

}  // namespace reliefbench
