#include "tuner/history/migrations.h"

#include "kernels/base/error.h"
#include "tuner/history/moment.h"

namespace reliefbench {
namespace {

// Ids are given by the one writer (Database::begin_writing), so that they are the same on both databases. `hash` and
// `key` are SHA-256 in hex of what makes a row what it is, since PostgreSQL's indices take no long texts. Texts that
// are JSON have sorted keys.
// NOLINTBEGIN(bugprone-suspicious-missing-comma): statements of several lines
const std::vector<Migration> kSteps = {
    {.version = 1,
     .statements =
         {"CREATE TABLE machine (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE)",
          "CREATE TABLE environment (id INTEGER PRIMARY KEY, hash TEXT NOT NULL UNIQUE, content TEXT NOT NULL)",
          "CREATE TABLE build (id INTEGER PRIMARY KEY, sha TEXT NOT NULL, parent TEXT NOT NULL,"
          " is_dirty INTEGER NOT NULL, UNIQUE (sha, parent, is_dirty))",
          "CREATE TABLE series (id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE,"
          " machine INTEGER NOT NULL REFERENCES machine (id), setting TEXT NOT NULL, case_id TEXT NOT NULL,"
          " scene TEXT NOT NULL, scene_key TEXT NOT NULL, technique TEXT NOT NULL, map TEXT NOT NULL,"
          " format TEXT NOT NULL, backend TEXT NOT NULL, device TEXT NOT NULL, metric TEXT NOT NULL,"
          " unit TEXT NOT NULL, lower_is_better INTEGER NOT NULL)",
          // origin: of a run, whatever was measured of it when it was imported
          "CREATE TABLE run (id INTEGER PRIMARY KEY, content TEXT NOT NULL UNIQUE, origin TEXT NOT NULL UNIQUE,"
          " kind TEXT NOT NULL, machine INTEGER NOT NULL REFERENCES machine (id),"
          " environment INTEGER NOT NULL REFERENCES environment (id), build INTEGER NOT NULL REFERENCES build (id),"
          " unix_s BIGINT NOT NULL, source TEXT NOT NULL, health TEXT NOT NULL)",
          "CREATE TABLE calibration (run INTEGER NOT NULL REFERENCES run (id), place INTEGER NOT NULL,"
          " device TEXT NOT NULL, control_ns DOUBLE PRECISION NOT NULL, mad DOUBLE PRECISION NOT NULL,"
          " n INTEGER NOT NULL, PRIMARY KEY (run, place))",
          "CREATE TABLE shader (id INTEGER PRIMARY KEY, hash TEXT NOT NULL UNIQUE)",
          "CREATE TABLE score (id INTEGER PRIMARY KEY, hash TEXT NOT NULL UNIQUE, content TEXT NOT NULL)",
          "CREATE TABLE repetition (run INTEGER NOT NULL REFERENCES run (id),"
          " series INTEGER NOT NULL REFERENCES series (id), median DOUBLE PRECISION NOT NULL,"
          " mad DOUBLE PRECISION NOT NULL, n INTEGER NOT NULL, value DOUBLE PRECISION NOT NULL,"
          " standard_error DOUBLE PRECISION NOT NULL, is_valid INTEGER NOT NULL, status TEXT NOT NULL,"
          " shader INTEGER REFERENCES shader (id), score INTEGER REFERENCES score (id), PRIMARY KEY (run, series))",
          // Apart from the numbers that every check reads.
          "CREATE TABLE sample (run INTEGER NOT NULL, series INTEGER NOT NULL, raw TEXT NOT NULL,"
          " PRIMARY KEY (run, series), FOREIGN KEY (run, series) REFERENCES repetition (run, series))",
          // An alert group. What is known of it, and what became of it, are rows of their own: the last one holds.
          "CREATE TABLE event (id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE,"
          " machine INTEGER NOT NULL REFERENCES machine (id), kind TEXT NOT NULL, what TEXT NOT NULL)",
          "CREATE TABLE change_point (id INTEGER PRIMARY KEY, event INTEGER NOT NULL REFERENCES event (id),"
          " good_run INTEGER NOT NULL, bad_run INTEGER NOT NULL, effect DOUBLE PRECISION NOT NULL,"
          " low DOUBLE PRECISION NOT NULL, high DOUBLE PRECISION NOT NULL, q DOUBLE PRECISION NOT NULL,"
          " algorithm INTEGER NOT NULL)",
          "CREATE TABLE change_point_series (change_point INTEGER NOT NULL REFERENCES change_point (id),"
          " series INTEGER NOT NULL REFERENCES series (id), PRIMARY KEY (change_point, series))",
          "CREATE TABLE event_state (id INTEGER PRIMARY KEY, event INTEGER NOT NULL REFERENCES event (id),"
          " unix_s BIGINT NOT NULL, state TEXT NOT NULL, author TEXT NOT NULL, said TEXT NOT NULL)",
          "CREATE TABLE annotation (id INTEGER PRIMARY KEY, run INTEGER REFERENCES run (id),"
          " event INTEGER REFERENCES event (id), unix_s BIGINT NOT NULL, author TEXT NOT NULL, said TEXT NOT NULL)"}},
    // The last row of an event is looked for of every event.
    {.version = 2, .statements = {"CREATE INDEX change_point_of_event ON change_point (event, id)"}},
    // What a run was made of, so that no part of it counts twice. Runs of before have none.
    {.version = 3,
     .statements = {"CREATE TABLE run_part (part TEXT PRIMARY KEY, run INTEGER NOT NULL REFERENCES run (id))"}}};
// NOLINTEND(bugprone-suspicious-missing-comma)

const std::string kVersionTable = "reliefbench_schema";

/// 0 of an empty database. throws: Error(bad_input): one of something else
int schema_version(Database& database) {
  // In this order: between two questions another process may commit the tables, all at once.
  if (database.is_empty()) return 0;
  if (!database.has_table(kVersionTable))
    fail_input("{}: is no history: it has tables, but none called {}", database.shown(), kVersionTable);
  return static_cast<int>(number_of(database.sql(), "SELECT COALESCE(MAX(version), 0) FROM " + kVersionTable));
}

/// throws: Error(bad_input): what this program does not know
void check_is_known(const Database& database, int version, int last) {
  if (version > last)
    fail_input("{}: was made by a newer reliefbench (schema {}; this one knows {})", database.shown(), version, last);
}

}  // namespace

std::span<const Migration> migrations() { return kSteps; }

void migrate(Database& database, std::span<const Migration> steps) {
  const int last = steps.back().version;
  const auto version = [&] {
    const int found = schema_version(database);
    check_is_known(database, found, last);
    return found;
  };
  if (version() == last) return;
  Transaction transaction(database, Transaction::Kind::write);
  const int before = version();  // another process may have done it
  if (before == 0)
    database.sql() << "CREATE TABLE " << kVersionTable << " (version INTEGER PRIMARY KEY, unix_s BIGINT NOT NULL)";
  for (const Migration& step : steps.subspan(static_cast<std::size_t>(before))) {
    for (const std::string_view statement : step.statements) database.sql() << std::string(statement);
    insert_row(database.sql(), kVersionTable + " (version, unix_s)", step.version, moment_now());
  }
  transaction.commit();
}

int check_is_history(Database& database, std::span<const Migration> steps) {
  const int version = schema_version(database);
  check_is_known(database, version, steps.back().version);
  if (version == 0)
    throw Error(Exit::nothing_measured,
                fmt::format("{}: holds no history yet; `reliefbench track ingest` fills it", database.shown()));
  return version;
}

void check_schema(Database& database, std::span<const Migration> steps) {
  const int last = steps.back().version;
  const int version = check_is_history(database, steps);
  if (version < last)
    fail_input("{}: has schema {}, this reliefbench reads {}; the next `track ingest` or `check` brings it there",
               database.shown(), version, last);
}

}  // namespace reliefbench
