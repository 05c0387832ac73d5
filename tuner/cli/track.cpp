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

LabelOptions add_label_options(CLI::App& command) {
  return {
      .commit = command.add_option("--commit", "what was measured; the commit that reliefbench was built from")
                    ->type_name("SHA"),
      .parent = command.add_option("--parent", "the commit before it")->type_name("SHA"),
      .time = command.add_option("--time", "2026-11-22T12:00:00Z or @1795348800; when the run was started")
                  ->type_name("TIME"),
      .machine =
          command.add_option("--machine", "what it was measured on; the name of the run's host")->type_name("NAME")};
}

NightLabels LabelOptions::labels() const {
  NightLabels labels;
  if (!commit->empty()) labels.commit = commit->as<std::string>();
  if (!parent->empty()) labels.parent = parent->as<std::string>();
  if (!machine->empty()) labels.machine = machine->as<std::string>();
  if (!time->empty()) labels.unix_s = parse_moment(time->as<std::string>(), "--time");
  return labels;
}

void add_track_command(CLI::App& app, int& exit_code) {
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
