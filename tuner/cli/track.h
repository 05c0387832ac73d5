#pragma once
#include <string>

#include "kernels/base/error.h"
#include "tuner/decide/track.h"
#include "tuner/history/history.h"
#include "tuner/history/ingest.h"

namespace CLI {
class App;
}  // namespace CLI

namespace reliefbench {

// One function a subcommand of `track`, as in commands.h.
void add_track_night(CLI::App& track, Exit& exit_code);
void add_track_ingest(CLI::App& track, Exit& exit_code);
void add_track_check(CLI::App& track, Exit& exit_code);
void add_track_report(CLI::App& track, Exit& exit_code);
void add_track_confirm(CLI::App& track, Exit& exit_code);
void add_track_accept(CLI::App& track, Exit& exit_code);
void add_track_annotate(CLI::App& track, Exit& exit_code);
void add_track_list(CLI::App& track, Exit& exit_code);
void add_track_export(CLI::App& track, Exit& exit_code);

/// --db, which every subcommand asks for.
void add_database_option(CLI::App& command, std::string& database);
/// Which nights: --machine and --since.
void add_night_options(CLI::App& command, History::Query& nights);
/// What is said of a night beside its files: --commit, --parent, --time and --machine.
void add_label_options(CLI::App& command, NightLabels& labels);

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
/// All but --db and which nights.
void add_check_options(CLI::App& command, CheckArguments& arguments);

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

/// Who is at the keyboard.
[[nodiscard]] std::string user_name();

}  // namespace reliefbench
