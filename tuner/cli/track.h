#pragma once
#include <string>

#include "kernels/base/error.h"
#include "tuner/decide/track.h"
#include "tuner/history/history.h"
#include "tuner/history/ingest.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace reliefbench {

// One function a subcommand of `track`, as in commands.h.
void add_track_night(CLI::App& track, int& exit_code);
void add_track_ingest(CLI::App& track, int& exit_code);
void add_track_check(CLI::App& track, int& exit_code);
void add_track_report(CLI::App& track, int& exit_code);
void add_track_confirm(CLI::App& track, int& exit_code);
void add_track_accept(CLI::App& track, int& exit_code);
void add_track_annotate(CLI::App& track, int& exit_code);
void add_track_list(CLI::App& track, int& exit_code);
void add_track_export(CLI::App& track, int& exit_code);

/// --db, which every subcommand asks for.
CLI::Option* add_database_option(CLI::App& command);

/// Which nights, as --machine and --since say.
struct NightOptions {
  const CLI::Option* machine;
  const CLI::Option* since;
  [[nodiscard]] History::Query query() const;  ///< throws: Error(bad_input): --since
};
[[nodiscard]] NightOptions add_night_options(CLI::App& command);

/// What is said of a night beside its files: --commit, --parent, --time and --machine.
struct LabelOptions {
  const CLI::Option* commit;
  const CLI::Option* parent;
  const CLI::Option* time;
  const CLI::Option* machine;
  [[nodiscard]] NightLabels labels() const;  ///< throws: Error(bad_input): --time
};
[[nodiscard]] LabelOptions add_label_options(CLI::App& command);

/// "3 runs of ci-7 are later: is its clock right?", of a run that was just added; "" where it is its machine's newest.
[[nodiscard]] std::string doubt_of_clock(const History& history, const RunRow& run);

/// How a history is checked, and where the answer goes.
struct CheckArguments {
  std::string database;
  History::Query query{};
  EventOptions options{};
  bool news_only = false;
  bool json = false;
  bool markdown = false;
  std::string junit{};  ///< a file; "" = none
};
struct CheckOptions {
  const CLI::Option* least_effect;
  const CLI::Option* least_nights;
  const CLI::Option* news;
  const CLI::Option* json;
  const CLI::Option* markdown;
  const CLI::Option* junit;
  /// throws: Error(bad_input): what makes no sense
  [[nodiscard]] CheckArguments arguments(const CLI::Option* database, const History::Query& query) const;
};
[[nodiscard]] CheckOptions add_check_options(CLI::App& command);

/// A history with what a check makes of it. New states are stored, so that the ids of its events are known.
struct CheckedHistory {
  std::string title;  ///< the database's name, without a password
  HistoryView view;
  TrackCheck check;
};
/// throws: Error as History's constructor
[[nodiscard]] CheckedHistory checked_history(const CheckArguments& arguments);

/// Prints a check's answer. returns: exit_of() it
Exit print_check(const CheckedHistory& checked, const CheckArguments& arguments);

/// Writes the trend page. throws: FileError
void write_trend_page(const CheckedHistory& checked, const CheckArguments& arguments, const std::string& file);

/// The event of that id. throws: Error(bad_input): there is none, naming those that are open
[[nodiscard]] const EventRow& find_event(const HistoryView& view, std::int64_t id);

/// Who is at the keyboard, unless a name is given.
[[nodiscard]] std::string author(const CLI::Option* by);

}  // namespace reliefbench
