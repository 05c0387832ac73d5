#pragma once
#include "tuner/history/database.h"
#include "tuner/history/history.h"

namespace reliefbench {

struct History::Connection {
  Connection(const std::string& name, bool may_write) : database(name, may_write) {}
  Database database;
};

/// What of a history a query asks for; called within one reading transaction.
[[nodiscard]] HistoryView read_history(soci::session& sql, const History::Query& query);
/// All events of a machine, or of all ("").
[[nodiscard]] std::vector<EventRow> read_events(soci::session& sql, const std::string& machine);
/// Writes what is new of events; called within the writer's transaction. returns: their ids
std::vector<std::int64_t> write_events(soci::session& sql, std::span<const EventRow> events);

/// Text that both databases keep: bytes that are no UTF-8, and NUL, become U+FFFD.
[[nodiscard]] std::string storable(const std::string& text);
/// Raw samples as one text, a JSON list, and back.
[[nodiscard]] std::string stored_samples(const std::vector<double>& samples);
[[nodiscard]] std::vector<double> parse_samples(const std::string& text);

/// The id that the next row of a table gets from its one writer.
[[nodiscard]] std::int64_t next_id(soci::session& sql, const std::string& table);
/// The machine's id; it is added if it is new.
[[nodiscard]] std::int64_t machine_id(soci::session& sql, const std::string& name);

}  // namespace reliefbench
