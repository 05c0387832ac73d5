#include "tuner/history/database.h"

#include <fmt/format.h>
#include <soci/sqlite3/soci-sqlite3.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <thread>

#include "kernels/base/error.h"
#include "kernels/base/file_error.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

constexpr int kPatience_s = 30;
/// Of all writers of a history on PostgreSQL: "relief" in ASCII.
constexpr const char* kWriterLock = "SELECT pg_advisory_xact_lock(125779935028582)";

bool is_server_url(std::string_view name) {
  return name.starts_with("postgresql://") || name.starts_with("postgres://");
}

/// Whether the value of a URL's key is a secret: libpq has `password` and `sslpassword`, decodes a key's %70 and
/// refuses capitals, but what stands behind them is as secret.
bool is_secret(std::string key) {
  std::ranges::transform(key, key.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return key.ends_with("password") || key.find('%') != std::string::npos;
}

/// throws: Error(bad_input): a '%' that encodes no character, of which libpq would tell with the text round it
void check_percent_signs(std::string_view url) {
  const auto is_digit = [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; };
  for (std::size_t at = url.find('%'); at != std::string_view::npos; at = url.find('%', at + 1)) {
    const std::string_view code = url.substr(at + 1, 2);
    if (code.size() < 2 || !std::ranges::all_of(code, is_digit) || code == "00")
      fail_input("the URL of the database has a '%' that encodes no character: write it as %25");
  }
}

/// The URL with stars for its passwords.
/// throws: Error(bad_input) where it is not certain which part is the password, or that libpq would not tell it
std::string without_password(const std::string& url) {
  check_percent_signs(url);
  const std::size_t begin = url.find("://") + 3;
  const std::size_t end = std::min(url.find_first_of("/?", begin), url.size());
  std::string shown = url;
  const std::size_t at = url.find('@', begin);
  if (at != url.rfind('@') || (at != std::string::npos && at > end))
    fail_input("the URL of the database has an '@' that does not end its password: write @ as %40, / as %2F, ? as %3F");
  for (std::size_t key = url.find('?', end); key != std::string::npos; key = shown.find('&', key + 1)) {
    const std::size_t equals = shown.find('=', key);
    if (equals == std::string::npos) break;
    if (is_secret(shown.substr(key + 1, equals - key - 1)))
      shown.replace(equals + 1, shown.find('&', equals) - equals - 1, "***");
  }
  const std::size_t colon = at == std::string::npos ? at : url.find(':', begin);
  if (colon < at) shown.replace(colon + 1, at - colon - 1, "***");
  return shown;
}

/// A path as a URI, which SOCI's list of options can hold and which says how the file is opened.
std::string file_uri(const fs::path& path, std::string_view mode) {
  std::string uri = "file:";
  for (const char c : fs::absolute(path).lexically_normal().string()) {
    const bool is_plain =
        std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '/' || c == '.' || c == '_' || c == '-';
    uri += is_plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return fmt::format("dbname={}?{} timeout={}", uri, mode, kPatience_s);
}

/// The first line, without what SOCI puts before it.
std::string words_of(const soci::soci_error& error) {
  std::string text = error.get_error_message();
  for (const std::string_view mark :
       {"Cannot establish connection to the database.", "Cannot execute query.", "Cannot prepare statement.",
        "sqlite3_statement_backend::prepare: ", "sqlite3_statement_backend::loadOne: ", "ERROR:", "FATAL:"}) {
    if (text.starts_with(mark)) text.erase(0, mark.size());
    text.erase(0, text.find_first_not_of(" \n"));
  }
  return text.substr(0, text.find('\n'));
}

int sqlite_result(const soci::soci_error& error) {
  const auto* own = dynamic_cast<const soci::sqlite3_soci_error*>(&error);
  return own == nullptr ? SQLITE_ERROR : own->result() & 0xff;
}

/// The errno that made SQLite give up.
int system_error(soci::session& sql, int result) {
  if (result == SQLITE_FULL || sql.get_backend() == nullptr) return ENOSPC;
  const int known =
      sqlite_api::sqlite3_system_errno(static_cast<soci::sqlite3_session_backend&>(*sql.get_backend()).conn_);
  return known == 0 ? EIO : known;
}

/// A history's file goes over to a write-ahead log once; SQLite itself does not wait where another process does so now.
void use_write_ahead_log(soci::session& sql) {
  std::string mode;
  for (int tries = 0;; ++tries) {
    try {
      sql << "PRAGMA journal_mode=WAL", soci::into(mode);
      return;
    } catch (const soci::soci_error& error) {
      if (sqlite_result(error) != SQLITE_BUSY || tries == 100 * kPatience_s) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
}

}  // namespace

Database::Database(const std::string& name, bool may_write)
    : name_(name), shown_(is_server_url(name) ? without_password(name) : name), is_server_(is_server_url(name)) {
  guarded([&] { is_server_ ? open_server() : open_file(may_write); });
}

void Database::open_file(bool may_write) {
  static const int with_uris = sqlite_api::sqlite3_config(SQLITE_CONFIG_URI, 1);
  static_cast<void>(with_uris);
  const fs::path path(name_);
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) fail_input("{}: is a folder, expected a history's file", name_);
  if (!may_write && !fs::exists(path, ignored))
    throw Error(Exit::nothing_measured,
                fmt::format("{}: there is no such history; `reliefbench track ingest` makes one", name_));
  if (const fs::path folder = fs::absolute(path).parent_path(); !fs::is_directory(folder, ignored))
    fail_file(folder, "the history's folder", ENOENT);
  sql_.open(soci::sqlite3, file_uri(path, may_write ? "mode=rwc" : "mode=ro"));
  int tables = 0;
  try {
    sql_ << "SELECT COUNT(*) FROM sqlite_master", soci::into(tables);
  } catch (const soci::soci_error& error) {
    // The log of a file in a folder where nobody may write can be neither read nor made, nor is anything being written.
    const int result = sqlite_result(error);
    if (may_write || (result != SQLITE_CANTOPEN && result != SQLITE_READONLY)) throw;
    sql_.close();
    sql_.open(soci::sqlite3, file_uri(path, "mode=ro&immutable=1"));
  }
  if (!may_write) return;
  use_write_ahead_log(sql_);
  // A night that was said to be imported stays so when the power fails; that costs one fsync a night.
  sql_ << "PRAGMA synchronous=FULL";
  sql_ << "PRAGMA foreign_keys=ON";
}

void Database::open_server() {
  // A server that does not answer, or goes away without a word, is not waited for for ever.
  const std::string patience = fmt::format("connect_timeout=10&tcp_user_timeout={}", 1000 * kPatience_s);
  sql_.open("postgresql", fmt::format("{}{}{}", name_, name_.find('?') == std::string::npos ? '?' : '&', patience));
  sql_ << "SET client_min_messages = error";
  sql_ << fmt::format("SET lock_timeout = {}", 1000 * kPatience_s);
}

bool Database::has_table(const std::string& table) {
  const std::string query = is_server_ ? "SELECT COUNT(*) FROM information_schema.tables WHERE table_schema = "
                                         "current_schema() AND table_name = :name"
                                       : "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = :name";
  return number_of(sql_, query, table) > 0;
}

bool Database::is_empty() {
  return number_of(sql_, is_server_ ? "SELECT COUNT(*) FROM information_schema.tables WHERE table_schema = "
                                      "current_schema()"
                                    : "SELECT COUNT(*) FROM sqlite_master") == 0;
}

void Database::begin_writing() {
  sql_ << (is_server_ ? "BEGIN" : "BEGIN IMMEDIATE");
  if (is_server_) sql_ << kWriterLock;
}

void Database::begin_reading() { sql_ << (is_server_ ? "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY" : "BEGIN"); }

void Database::fail(const soci::soci_error& error) {
  std::string words = words_of(error);
  if (is_server_) {
    // libpq tells some faults of a URL with the whole of it.
    if (const std::size_t at = words.find(name_); at != std::string::npos) words.replace(at, name_.size(), shown_);
    if (words.find("shared library") != std::string::npos)
      fail_environment("{}: SOCI's part for PostgreSQL is not installed: Debian's package libsoci-postgresql4.0",
                       shown_);
    fail_environment("{}: {}", shown_, words);
  }
  const int result = sqlite_result(error);
  switch (result) {
    case SQLITE_FULL:
    case SQLITE_IOERR:
      fail_environment("{}: cannot be read or written: {}", shown_,
                       std::generic_category().message(system_error(sql_, result)));
    case SQLITE_BUSY:
      fail_environment("{}: another process has been writing to it for {} s", shown_, kPatience_s);
    case SQLITE_READONLY:
      fail_environment("{}: may only be read", shown_);
    case SQLITE_NOTADB:
      fail_input("{}: is no history: not a database of SQLite", shown_);
    case SQLITE_CORRUPT:
      fail_input("{}: is damaged ({}); make it anew from the runs' folders", shown_, words);
    default:
      fail_environment("{}: {}", shown_, words);
  }
}

Transaction::Transaction(Database& database, Kind kind) : sql_(database.sql()) {
  try {
    kind == Kind::write ? database.begin_writing() : database.begin_reading();
  } catch (const soci::soci_error&) {
    try {
      sql_ << "ROLLBACK";
    } catch (const soci::soci_error&) {  // it did not even begin
    }
    throw;
  }
}

Transaction::~Transaction() {
  if (!is_open_) return;
  try {
    sql_ << "ROLLBACK";
  } catch (const soci::soci_error&) {  // the server is gone, or SQLite has done it by itself
  }
}

void Transaction::commit() {
  sql_ << "COMMIT";
  is_open_ = false;
}

}  // namespace reliefbench
