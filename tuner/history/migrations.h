#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "tuner/history/database.h"

namespace reliefbench {

/// A step from one version of the schema to the next, in SQL that SQLite and PostgreSQL take.
struct Migration {
  int version;                               ///< that it leads to, from 1 without gaps
  std::vector<std::string_view> statements;  ///< only such as keep all rows
};
/// All there were; a step that was released is never changed.
[[nodiscard]] std::span<const Migration> migrations();

/// Brings a database to the last version, all of it or nothing; an empty one from 0. Several processes may try at once.
/// throws: Error(bad_input): a newer schema, a database of something else
void migrate(Database& database, std::span<const Migration> steps = migrations());

/// returns: its schema's version
/// throws: Error(bad_input): a newer schema, a database of something else; Error(nothing_measured): an empty one
int check_is_history(Database& database, std::span<const Migration> steps = migrations());

/// throws: as above, and Error(bad_input): another schema than the last version
void check_schema(Database& database, std::span<const Migration> steps = migrations());

}  // namespace reliefbench
