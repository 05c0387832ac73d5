// Which databases are a history, and how one of an older schema goes on; on SQLite and on PostgreSQL alike.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "kernels/base/error.h"
#include "tests/history_rig.h"
#include "tuner/history/connection.h"
#include "tuner/history/migrations.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

std::string history_error(const std::string& database, History::Access access, Exit code) {
  try {
    const History history(database, access);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  return "no error";
}

class HistorySchemaTest : public OnBothDatabases {};
INSTANTIATE_TEST_SUITE_P(Both, HistorySchemaTest, kBothDatabases, database_kind);

TEST_P(HistorySchemaTest, a_history_of_the_first_schema_goes_on) {
  {
    Database database(database_, /*may_write=*/true);
    database.guarded([&] {
      migrate(database, migrations().first(1));
      soci::session& sql = database.sql();
      insert_row(sql, "machine (id, name)", 1, std::string("farm"));
      insert_row(sql, "event (id, key, machine, kind, what)", 1, std::string("farm|slower|cone|2"), 1,
                 std::string("slower"), std::string("cone"));
      insert_row(sql, "change_point (id, event, good_run, bad_run, effect, low, high, q, algorithm)", 1, 1, 1, 2, 0.1,
                 0.05, 0.15, 0.5, 1);
      insert_row(sql, "event_state (id, event, unix_s, state, author, said)", 1, 1, 10, std::string("suspect"),
                 std::string("check"), std::string("seen"));
    });
  }
  EXPECT_THAT(history_error(database_, kRead, Exit::bad_input), HasSubstr("has schema 1"));
  History history = History::existing(database_);  // as a check opens it
  std::vector<EventRow> events = history.load({}).events;
  ASSERT_EQ(events.size(), 1U);
  events.front().states.push_back({.unix_s = 11, .state = EventState::accepted, .by = "me", .text = ""});
  EXPECT_EQ(history.add_events(events), std::vector<std::int64_t>{1});
  events = History(database_, kRead).load({}).events;
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events.front().key, "farm|slower|cone|2");
  EXPECT_EQ(events.front().states.size(), 2U);
}

TEST_P(HistorySchemaTest, goes_from_one_schema_to_the_next_and_refuses_a_newer_one) {
  { History(database_, kWrite).add(make_night({})); }
  const std::string before = content_of(database_);
  std::vector<Migration> steps(migrations().begin(), migrations().end());
  const int next = steps.back().version + 1;
  steps.push_back({.version = next,
                   .statements = {"CREATE TABLE extra (id INTEGER PRIMARY KEY)",
                                  "ALTER TABLE run ADD COLUMN note TEXT NOT NULL DEFAULT ''"}});
  {
    Database database(database_, /*may_write=*/true);
    std::vector<Migration> broken = steps;
    broken.back().statements.push_back("NOT SQL");
    EXPECT_THROW(database.guarded([&] { migrate(database, broken); }), Error);
    EXPECT_FALSE(database.has_table("extra")) << "all of it or nothing";
  }
  EXPECT_EQ(content_of(database_), before);
  {
    Database old(database_, /*may_write=*/false);
    EXPECT_THROW(check_schema(old, steps), Error);
    Database database(database_, /*may_write=*/true);
    database.guarded([&] { migrate(database, steps); });
    EXPECT_TRUE(database.has_table("extra"));
    EXPECT_EQ(number_of(database.sql(), "SELECT COUNT(*) FROM run WHERE note = ''"), 1);
  }
  for (const History::Access access : {kRead, kWrite})
    EXPECT_THAT(
        history_error(database_, access, Exit::bad_input),
        HasSubstr(fmt::format("was made by a newer reliefbench (schema {}; this one knows {})", next, next - 1)));
}

TEST_P(HistorySchemaTest, reads_no_empty_database_nor_one_of_something_else) {
  if (is_server()) {
    EXPECT_THAT(history_error(database_, kRead, Exit::nothing_measured), HasSubstr("holds no history yet"));
  }
  {
    Database database(database_, /*may_write=*/true);
    database.sql() << "CREATE TABLE places (id INTEGER)";
  }
  for (const History::Access access : {kRead, kWrite})
    EXPECT_THAT(history_error(database_, access, Exit::bad_input), HasSubstr("is no history"));
}

TEST(HistorySchemaFileTest, tells_what_is_no_history) {
  const TempFolder folder;
  const std::string missing = (folder / "none.db").string();
  EXPECT_THAT(history_error(missing, kRead, Exit::nothing_measured), HasSubstr("track ingest"));
  EXPECT_FALSE(std::filesystem::exists(missing)) << "reading makes nothing";
  EXPECT_THAT(history_error(folder.path().string(), kWrite, Exit::bad_input), HasSubstr("is a folder"));
  EXPECT_THAT(history_error((folder / "no/x.db").string(), kWrite, Exit::bad_input), HasSubstr("No such file"));
  const std::string text = (folder / "text.db").string();
  std::ofstream(text) << std::string(2000, 'x');
  EXPECT_THAT(history_error(text, kRead, Exit::bad_input), HasSubstr("not a database of SQLite"));
  EXPECT_THAT(history_error(text, kWrite, Exit::bad_input), HasSubstr("not a database of SQLite"));
}

TEST(HistorySchemaServerTest, hides_the_password_and_names_the_host) {
  const std::string text =
      history_error("postgresql://me:secret@nowhere.invalid/x?password=hidden&a=b", kRead, Exit::environment);
  EXPECT_THAT(text, HasSubstr("postgresql://me:***@nowhere.invalid/x?password=***"));
  EXPECT_THAT(text, ::testing::Not(::testing::AnyOf(HasSubstr("secret"), HasSubstr("hidden"), HasSubstr("\n"))));
  for (const std::string url :
       {"postgresql://me:sec@ret@host/x", "postgresql://me:sec/ret@host/x", "postgresql://me:sec?ret@host"})
    EXPECT_THAT(history_error(url, kRead, Exit::bad_input), ::testing::Not(HasSubstr("ret@")));
}

TEST(HistorySchemaServerTest, hides_every_password_of_a_query) {
  const auto shown = [](const std::string& query) {
    const std::string text = history_error("postgresql://nowhere.invalid/x?" + query, kRead, Exit::environment);
    return text.substr(0, text.find(": "));
  };
  for (const auto& [query, told] :
       {std::pair("sslpassword=a1&password=b2", "sslpassword=***&password=***"),
        std::pair("password=a1&sslpassword=b2&c=d", "password=***&sslpassword=***&c=d"),
        std::pair("a&password=b2", "a&password=***"),
        std::pair("pass%77ord=b2&c=password", "pass%77ord=***&c=password"), std::pair("PASSWORD=b2", "PASSWORD=***"),
        std::pair("password", "password"), std::pair("password=&a=b", "password=***&a=b")})
    EXPECT_EQ(shown(query), fmt::format("postgresql://nowhere.invalid/x?{}", told));
}

TEST(HistorySchemaServerTest, no_fault_of_a_url_tells_its_password) {
  for (const std::string url : {"postgresql://me:secr%et@host/x", "postgresql://me:secret%@host/x",
                                "postgresql://me:secret%00@host/x", "postgresql://host/x?password=secret%2"})
    EXPECT_THAT(history_error(url, kRead, Exit::bad_input),
                ::testing::AllOf(HasSubstr("%25"), ::testing::Not(HasSubstr("secr"))));
  EXPECT_THAT(history_error("postgresql://me:secret@[::1/x", kRead, Exit::environment),
              ::testing::AllOf(HasSubstr("me:***@[::1"), ::testing::Not(HasSubstr("secret"))));
}

}  // namespace
}  // namespace reliefbench
