#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/history/rows.h"

namespace reliefbench {

/// What one import brings: a run with its series' values, and the scores that they name by index.
struct Night {  // NOLINT(bugprone-exception-escape): moving a json does not throw
  struct Value {
    SeriesRow series;                  ///< id unset
    RepetitionRow row;                 ///< run and score unset
    std::optional<std::string> score;  ///< ScoreRow::values, serialised with sorted keys
  };
  RunRow run;  ///< id, environment unset
  nlohmann::json environment;
  std::vector<Value> values;           ///< each of another series
  std::string origin{};                ///< what stays as it is of a run that is gone on with; "": nothing goes on
  std::vector<std::string> parts{};    ///< part_keys() of its run: each is in a history once
  std::vector<std::string> skipped{};  ///< what was measured and is not in `values`, and why: for people
};

/// The history of a fleet: a database that run folders are imported into, and that can be made anew from them.
/// SQLite (a file, WAL) or PostgreSQL, by the same SQL and migrations. Rows are appended, never altered. Several
/// processes may write at once.
class History {
 public:
  enum class Access { read, write };  ///< write makes the database, and migrates an older schema

  /// database: a file's path, or "postgresql://..."
  /// throws: Error(nothing_measured): to be read, and there is none, or an empty database;
  ///         Error(bad_input): not a history, a newer schema;
  ///         Error(environment): read-only, full, or a server that does not answer
  History(const std::string& database, Access access);
  /// To write to one that is there, of whatever schema: what is not is not made. throws: as the constructor
  [[nodiscard]] static History existing(const std::string& database);
  ~History();
  /// For people: without a password.
  [[nodiscard]] const std::string& name() const;
  History(const History&) = delete;
  History& operator=(const History&) = delete;

  /// Adds a night, all of it or nothing. returns: its run's id; nothing where it is there already (by content)
  /// throws: Error(bad_input): an earlier state of this run is there, or a part of it (of a merged one, or by one), a
  ///         series twice, a number that is not finite
  std::optional<std::int64_t> add(const Night& night);

  /// What is asked for.
  struct Query {
    std::optional<std::int64_t> since_unix_s{};  ///< runs from then on
    std::string machine{};                       ///< "" = all
    bool with_samples = false;
    std::int64_t run = 0;  ///< only that one; 0 = all
  };
  /// Series without a night in the view are left out; events and their annotations are not, whatever runs they name.
  [[nodiscard]] HistoryView load(const Query& query) const;

  /// How many runs of a machine are later than that.
  [[nodiscard]] std::int64_t runs_after(const std::string& machine, std::int64_t unix_s) const;

  /// annotation: its id unset. throws: Error(bad_input): no such run or event
  void annotate(const AnnotationRow& annotation);

  /// Appends a check's events: new ones with their first state, known ones (by key) with states that are new, and what
  /// is now known of their interval and effect as a new change-point row. returns: their ids
  std::vector<std::int64_t> add_events(std::span<const EventRow> events);

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

}  // namespace reliefbench
