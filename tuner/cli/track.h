#pragma once
#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "tuner/decide/track.h"
#include "tuner/history/history.h"

namespace reliefbench {

// The subcommands of `track`, one file each.
void add_track_ingest(CLI::App& track, int& exit_code);
void add_track_check(CLI::App& track, int& exit_code);
void add_track_report(CLI::App& track, int& exit_code);
void add_track_night(CLI::App& track, int& exit_code);
void add_track_accept(CLI::App& track, int& exit_code);
void add_track_confirm(CLI::App& track, int& exit_code);
void add_track_annotate(CLI::App& track, int& exit_code);
void add_track_list(CLI::App& track, int& exit_code);
void add_track_export(CLI::App& track, int& exit_code);

/// Which history is looked at, and how closely.
struct CheckArguments {
  std::string database;
  std::string since;
  std::string machine;
  double least_effect = EventOptions{}.change.least_effect;
  std::size_t least_nights = EventOptions{}.change.least_nights;
  bool news = false;

  [[nodiscard]] EventOptions options() const;      ///< throws: Error(bad_input)
  [[nodiscard]] History::Query query() const;      ///< throws: Error(bad_input)
};
/// Adds --since, --machine, --least-effect and --least-nights; `arguments` must outlive the parse.
void add_check_options(CLI::App& command, CheckArguments& arguments);
void add_database_option(CLI::App& command, std::string& database);

/// Where a check's answer goes besides standard output.
struct CheckOutput {
  bool json = false;
  bool markdown = false;
  std::string junit;  ///< a file; "" = none
};
void add_check_outputs(CLI::App& command, CheckOutput& output);

/// A history with what a check makes of it. New states are stored, so that the ids of its events are known.
struct CheckedHistory {
  HistoryView view;
  TrackCheck check;
};
[[nodiscard]] CheckedHistory checked_history(History& history, const CheckArguments& arguments);

/// Prints a check's answer. returns: exit_of() it
Exit print_check(const CheckedHistory& checked, const CheckArguments& arguments, const CheckOutput& output);

/// Writes the trend page. throws: FileError
void write_trend_page(const CheckedHistory& checked, const CheckArguments& arguments, const std::string& file);

/// The events of a history, the one of an id. throws: Error(bad_input): there is none, naming those that are open
[[nodiscard]] const EventRow& find_event(const HistoryView& view, std::int64_t id);

/// A history's name without its password.
[[nodiscard]] std::string database_title(const std::string& database);

/// "2026-11-24T03:00:00Z", "2026-11-24" or "@UNIX_SECONDS" as seconds since 1970. throws: Error(bad_input), naming the option
[[nodiscard]] std::int64_t parse_time(const std::string& text, std::string_view option);

}  // namespace reliefbench
