#pragma once
#include <string>

#include "kernels/base/error.h"
#include "tuner/history/history.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace reliefbench {

// One function a subcommand of `track`, as in commands.h.
void add_track_ingest(CLI::App& track, int& exit_code);
void add_track_list(CLI::App& track, int& exit_code);
void add_track_annotate(CLI::App& track, int& exit_code);
void add_track_export(CLI::App& track, int& exit_code);

/// --db, which every subcommand asks for.
CLI::Option* add_database_option(CLI::App& command);

/// Which nights, as --machine, --since and --run say.
struct NightOptions {
  const CLI::Option* machine;
  const CLI::Option* since;
  [[nodiscard]] History::Query query() const;  ///< throws: Error(bad_input): --since
};
[[nodiscard]] NightOptions add_night_options(CLI::App& command);

}  // namespace reliefbench
