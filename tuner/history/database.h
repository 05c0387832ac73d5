#pragma once
// Debian's SOCI was built with Boost, whose headers ours would then need for what we don't use.
#include <soci/soci-config.h>
#undef SOCI_HAVE_BOOST
#undef SOCI_HAVE_BOOST_DATE_TIME
#include <soci/soci.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace reliefbench {

/// A connection to SQLite or PostgreSQL, by SOCI. What differs between the two stands here; all other SQL is one text
/// for both, and values go as parameters, never as part of it.
class Database {
 public:
  /// name: a file's path, or "postgresql://..."; a file that a writer names is made
  /// throws: Error as History's constructor
  Database(const std::string& name, bool may_write);

  [[nodiscard]] soci::session& sql() { return sql_; }
  /// For messages: without a password.
  [[nodiscard]] const std::string& shown() const { return shown_; }
  [[nodiscard]] bool has_table(const std::string& table);
  [[nodiscard]] bool is_empty();  ///< no table at all

  /// Begins a transaction of the one writer that there is at a time; others wait for it. 30 s at most
  void begin_writing();
  /// Begins a transaction that sees one state of the database, whatever is written meanwhile.
  void begin_reading();

  /// Does some work, whose failure is told by an Error.
  template <typename Work>
  auto guarded(Work&& work) -> decltype(work()) {
    try {
      return std::forward<Work>(work)();
    } catch (const soci::soci_error& error) {
      fail(error);
    }
  }

 private:
  void open_file(bool may_write);
  void open_server();
  [[noreturn]] void fail(const soci::soci_error& error);

  std::string name_;
  std::string shown_;
  bool is_server_;
  soci::session sql_;
};

/// A transaction, which is taken back unless it is committed.
class Transaction {
 public:
  enum class Kind { read, write };
  Transaction(Database& database, Kind kind);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  soci::session& sql_;
  bool is_open_ = true;
};

/// The id of a row, or of none.
struct OptionalId {
  std::int64_t id = 0;  ///< 0: none, NULL in the table
};

/// A server is asked for so many rows at once: far away, what counts is how often it is asked.
inline constexpr std::size_t kRowsAtOnce = 64;

/// Rows for a table, many to a statement.
/// Columns: the values' types
template <typename... Columns>
class Insert {
 public:
  /// into: "table (column, ...)"
  Insert(soci::session& sql, std::string into) : sql_(sql), into_(std::move(into)) {}
  /// Keeps a row for write().
  void operator()(Columns... values) { rows_.emplace_back(std::move(values)...); }
  void write() {
    for (std::size_t begin = 0; begin < rows_.size(); begin += kRowsAtOnce)
      write(std::span(rows_).subspan(begin, std::min(kRowsAtOnce, rows_.size() - begin)));
    rows_.clear();
  }

 private:
  using Row = std::tuple<Columns...>;

  template <typename Column>
  static std::string place_of(std::size_t i) {
    const std::string name = ":v" + std::to_string(i);
    return std::is_same_v<Column, OptionalId> ? "NULLIF(" + name + ", 0)" : name;
  }
  template <typename Column>
  static auto& bound(Column& value) {
    if constexpr (std::is_same_v<Column, OptionalId>)
      return value.id;
    else
      return value;
  }
  void write(std::span<Row> rows) {
    std::string text = "INSERT INTO " + into_ + " VALUES ";
    std::size_t place = 0;
    for (std::size_t row = 0; row < rows.size(); ++row) {
      std::size_t column = 0;
      text += row == 0 ? "(" : ", (";
      ((text += (column++ == 0 ? "" : ", ") + place_of<Columns>(place++)), ...);
      text += ")";
    }
    soci::details::prepare_temp_type prepared = (sql_.prepare << text);
    for (Row& row : rows) std::apply([&](Columns&... value) { ((prepared, soci::use(bound(value))), ...); }, row);
    soci::statement(prepared).execute(/*with_data_exchange=*/true);
  }

  soci::session& sql_;
  std::string into_;
  std::vector<Row> rows_{};
};

/// Inserts one row.
template <typename... Columns>
void insert_row(soci::session& sql, const std::string& into, Columns... values) {
  Insert<Columns...> insert(sql, into);
  insert(std::move(values)...);
  insert.write();
}

/// A query's parameter, or several of them.
template <typename Parameter>
void bind(soci::details::prepare_temp_type& query, const Parameter& parameter) {
  query, soci::use(parameter);
}
inline void bind(soci::details::prepare_temp_type& query, const std::span<const std::string>& parameters) {
  for (const std::string& parameter : parameters) query, soci::use(parameter);
}

/// Calls `row` with the values of each row that a query finds.
/// Columns: their types; none may be NULL. parameters: of the query, in the order of its :names
template <typename... Columns, typename Row, typename... Parameters>
void each_row(soci::session& sql, const std::string& query, const Row& row, const Parameters&... parameters) {
  std::tuple<Columns...> values;
  soci::details::prepare_temp_type prepared = (sql.prepare << query);
  std::apply([&](Columns&... value) { ((prepared, soci::into(value)), ...); }, values);
  (bind(prepared, parameters), ...);
  soci::statement statement(prepared);
  statement.execute();
  while (statement.fetch()) std::apply(row, values);
}

/// The number that a query finds; 0 where it finds no row.
template <typename... Parameters>
[[nodiscard]] std::int64_t number_of(soci::session& sql, const std::string& query, const Parameters&... parameters) {
  std::int64_t number = 0;
  each_row<std::int64_t>(
      sql, query, [&](std::int64_t found) { number = found; }, parameters...);
  return number;
}

}  // namespace reliefbench
