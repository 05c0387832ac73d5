// The history's store, on SQLite and on PostgreSQL alike.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/history_rig.h"
#include "tuner/history/connection.h"
#include "tuner/history/export.h"
#include "tuner/results/csv.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

class HistoryTest : public OnBothDatabases {};
INSTANTIATE_TEST_SUITE_P(Both, HistoryTest, kBothDatabases, database_kind);

TEST_P(HistoryTest, gives_back_a_night_as_it_was) {
  const Night night = make_night({});
  EXPECT_EQ(History(database_, kWrite).add(night), 1);
  const HistoryView view = History(database_, kRead).load({.with_samples = true});
  ASSERT_EQ(view.runs.size(), 1U);
  const RunRow& run = view.runs.front();
  EXPECT_EQ(run.content, night.run.content);
  EXPECT_EQ(run.machine, "farm");
  EXPECT_EQ(run.unix_s, night.run.unix_s);
  EXPECT_EQ(run.build.commit, "c-one");
  EXPECT_EQ(run.health, night.run.health);
  ASSERT_EQ(run.calibrations.size(), 1U);
  EXPECT_EQ(run.calibrations.front().control_ns, 1000);
  ASSERT_EQ(view.environments.size(), 1U);
  EXPECT_EQ(view.environments.front().content, night.environment);
  ASSERT_EQ(view.series.size(), 4U);
  ASSERT_EQ(view.nights.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(view.series[i].setting, night.values[i].series.setting);
    ASSERT_EQ(view.nights[i].size(), 1U);
    const RepetitionRow& row = view.nights[i].front();
    const RepetitionRow& given = night.values[i].row;
    EXPECT_EQ(row.median, given.median) << "to the last bit";
    EXPECT_EQ(row.mad, given.mad);
    EXPECT_EQ(row.value, given.value);
    EXPECT_EQ(row.standard_error, given.standard_error);
    EXPECT_EQ(row.samples, given.samples);
    EXPECT_EQ(row.code, given.code);
    EXPECT_TRUE(row.is_valid);
    EXPECT_EQ(view.scores.at(static_cast<std::size_t>(row.score - 1)).values,
              nlohmann::json::parse(*night.values[i].score));
  }
  EXPECT_TRUE(History(database_, kRead).load({}).nights.front().front().samples.empty());
}

TEST_P(HistoryTest, adds_no_content_twice_and_stores_equal_things_once) {
  History history(database_, kWrite);
  EXPECT_EQ(history.add(make_night({})), 1);
  const std::string once = content_of(database_);
  EXPECT_EQ(history.add(make_night({})), std::nullopt);
  EXPECT_EQ(content_of(database_), once);
  EXPECT_EQ(history.add(make_night({.content = "two", .unix_s = 1'795'435'200, .factor = 1.1})), 2);
  const HistoryView view = history.load({});
  EXPECT_EQ(view.series.size(), 4U);
  EXPECT_EQ(view.scores.size(), 4U) << "the same errors, the same rows";
  EXPECT_EQ(view.environments.size(), 1U);
  EXPECT_EQ(view.nights.front().size(), 2U);
}

TEST_P(HistoryTest, sorts_nights_by_time_and_takes_what_is_asked_for) {
  History history(database_, kWrite);
  history.add(make_night({.content = "b", .unix_s = 2000}));
  history.add(make_night({.content = "a", .unix_s = 1000, .cases = 6}));
  history.add(make_night({.content = "c", .unix_s = 2500, .machine = "other"}));
  const HistoryView all = history.load({});
  ASSERT_EQ(all.runs.size(), 3U);
  EXPECT_EQ(all.runs[0].id, 2);
  EXPECT_EQ(all.series.size(), 10U);
  EXPECT_EQ(all.nights[0][0].run, 2);
  EXPECT_EQ(all.nights[0][1].run, 1);
  const HistoryView late = history.load({.since_unix_s = 1500, .machine = "farm"});
  ASSERT_EQ(late.runs.size(), 1U);
  EXPECT_EQ(late.series.size(), 4U) << "series without a night in the view are left out";
  EXPECT_EQ(late.runs.front().calibrations.size(), 1U);
  EXPECT_TRUE(history.load({.machine = "nobody's"}).series.empty());
}

TEST_P(HistoryTest, a_changed_environment_is_another) {
  History history(database_, kWrite);
  history.add(make_night({.content = "a", .unix_s = 1}));
  history.add(make_night({.content = "b", .unix_s = 2, .driver = "driver 2"}));
  history.add(make_night({.content = "c", .unix_s = 3}));
  const HistoryView view = history.load({});
  EXPECT_EQ(view.environments.size(), 2U);
  EXPECT_NE(view.runs[0].environment, view.runs[1].environment);
  EXPECT_EQ(view.runs[0].environment, view.runs[2].environment);
}

TEST_P(HistoryTest, refuses_a_later_state_of_a_run_that_it_has) {
  History history(database_, kWrite);
  Night night = make_night({});
  night.origin = "origin";
  history.add(night);
  night.run.content = "more";
  try {
    history.add(night);
    ADD_FAILURE() << "expected an error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    EXPECT_THAT(error.what(), HasSubstr("an earlier state of it is run 1"));
  }
  EXPECT_EQ(history.load({}).runs.size(), 1U);
}

TEST_P(HistoryTest, no_part_of_a_run_counts_twice) {
  History history(database_, kWrite);
  Night night = make_night({});
  night.parts = {"a", "b", "b"};
  history.add(night);
  const std::string before = content_of(database_);
  night = make_night({.content = "two", .unix_s = 2});
  night.parts = {"c", "b"};
  EXPECT_THAT([&] { history.add(night); }, ::testing::ThrowsMessage<Error>(HasSubstr("run 1 of ")));
  EXPECT_EQ(content_of(database_), before);
  night.parts = {"c"};
  EXPECT_EQ(history.add(night), 2);
}

// As after a heightmap was changed: the case's id is what it was, the scene is another.
TEST_P(HistoryTest, series_of_one_name_are_told_apart_outside) {
  History history(database_, kWrite);
  history.add(make_night({.cases = 1}));
  Night changed = make_night({.content = "two", .unix_s = 1'795'435'200, .cases = 1});
  changed.values.front().series.setting = "cone@" + std::string(64, 'b');
  changed.values.front().series.scene_key = std::string(64, 'b');
  changed.run.build.is_dirty = true;
  history.add(changed);
  const std::vector<CsvRow> rows = parse_csv(otava_csv(history.load({})), "csv");
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_THAT(rows[0].cells, ::testing::ElementsAre("time", "commit", "cone@rocks/top?steps=0 [aaaaaaaa]",
                                                    "cone@rocks/top?steps=0 [bbbbbbbb]"));
  EXPECT_EQ(rows[1].cells[1], "c-one");
  EXPECT_EQ(rows[2].cells[1], "c-two-dirty");
  EXPECT_TRUE(bencher_json(history.load({.run = 2})).contains("cone@rocks/top?steps=0"));
}

TEST_P(HistoryTest, a_night_that_fails_leaves_nothing) {
  History history(database_, kWrite);
  Night night = make_night({});
  night.values.push_back(night.values.front());  // a series twice
  EXPECT_THROW(history.add(night), Error);
  const HistoryView view = history.load({});
  EXPECT_TRUE(view.runs.empty() && view.series.empty());
  night.values.pop_back();
  EXPECT_EQ(history.add(night), 1) << "and the connection goes on";
}

TEST_P(HistoryTest, keeps_hostile_text_as_text) {
  const std::string hostile = "a'b\"c\n\x1b[31m;DROP TABLE run;--:x $1 ?\t\xc3\xa9";
  const std::string broken = std::string("x\0y", 3) + "\xff";
  Night night = make_night({.cases = 1, .machine = hostile});
  night.run.source = night.run.build.commit = night.run.build.parent = hostile;
  night.run.calibrations.front().device = hostile;
  night.environment = {{hostile, broken}};
  SeriesRow& series = night.values.front().series;
  for (std::string* text : {&series.setting, &series.case_id, &series.scene, &series.scene_key, &series.technique,
                            &series.map, &series.format, &series.backend, &series.metric, &series.unit})
    *text = hostile + std::string(5000, 'x');
  series.device = broken;
  night.values.front().row.status = hostile;
  night.values.front().row.code = hostile;
  History history(database_, kWrite);
  ASSERT_EQ(history.add(night), 1);
  history.annotate({.run = 1, .unix_s = 1, .by = hostile, .text = broken});
  const HistoryView view = history.load({.machine = hostile});
  ASSERT_EQ(view.runs.size(), 1U);
  EXPECT_EQ(view.runs.front().machine, hostile);
  EXPECT_EQ(view.runs.front().build.commit, hostile);
  EXPECT_EQ(view.series.front().setting, series.setting);
  EXPECT_EQ(view.series.front().device, "x\xEF\xBF\xBDy\xEF\xBF\xBD") << "what no database keeps";
  EXPECT_EQ(view.nights.front().front().code, hostile);
  EXPECT_EQ(view.annotations.front().by, hostile);
  night.run.content = "again";
  ASSERT_EQ(history.add(night), 2);
  EXPECT_EQ(history.load({}).series.size(), 1U);
}

TEST_P(HistoryTest, keeps_events_and_appends_what_is_new_of_them) {
  History history(database_, kWrite);
  history.add(make_night({.content = "a", .unix_s = 1}));
  history.add(make_night({.content = "b", .unix_s = 2}));
  EventRow event{.key = "k",
                 .machine = "farm",
                 .kind = "slower",
                 .what = "cone",
                 .good_run = 1,
                 .bad_run = 2,
                 .effect = 0.1,
                 .low = 0.05,
                 .high = 0.15,
                 .q = 1.0 / 3,
                 .algorithm = 1,
                 .series = {3, 1},
                 .states = {{.unix_s = 10, .state = EventState::suspect, .by = "check", .text = "seen"}}};
  history.add_events(std::span(&event, 1));
  history.add_events(std::span(&event, 1));
  std::vector<EventRow> events = history.load({}).events;
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events.front().q, 1.0 / 3);
  EXPECT_EQ(events.front().series, (std::vector<std::int64_t>{1, 3}));
  EXPECT_EQ(events.front().states, event.states);
  event.effect = 0.2;
  event.series = {1};
  event.states.push_back({.unix_s = 11, .state = EventState::accepted, .by = "me", .text = ""});
  history.add_events(std::span(&event, 1));
  events = history.load({.machine = "farm"}).events;
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events.front().effect, 0.2);
  EXPECT_EQ(events.front().series, event.series);
  EXPECT_EQ(events.front().states, event.states);
  EXPECT_TRUE(history.load({.machine = "other"}).events.empty());
  history.annotate({.event = 1, .unix_s = 12, .by = "me", .text = "known"});
  EXPECT_EQ(history.load({}).annotations.size(), 1U);
  EXPECT_THROW(history.annotate({.event = 2, .by = "me", .text = "x"}), Error);
  EXPECT_THROW(history.annotate({.run = 3, .by = "me", .text = "x"}), Error);
}

TEST_P(HistoryTest, keeps_many_events_of_one_check) {
  History history(database_, kWrite);
  history.add(make_night({.content = "a", .unix_s = 1}));
  history.add(make_night({.content = "b", .unix_s = 2, .machine = "other"}));
  std::vector<EventRow> events;
  for (int i = 0; i < 200; ++i)
    events.push_back({.key = fmt::format("k{}", i % 199),  // one twice
                      .machine = i % 2 == 0 ? "farm" : "other",
                      .kind = "slower",
                      .what = fmt::format("case {}", i),
                      .good_run = 1,
                      .bad_run = 2,
                      .effect = i == 199 ? 2.0 : 1.0,
                      .series = {1, 2},
                      .states = {{.unix_s = i, .state = EventState::suspect, .by = "check", .text = "seen"}}});
  events.back().machine = "farm";
  const std::vector<std::int64_t> ids = history.add_events(events);
  ASSERT_EQ(ids.size(), 200U);
  for (std::size_t i = 0; i < 199; ++i) EXPECT_EQ(ids[i], static_cast<std::int64_t>(i + 1));
  EXPECT_EQ(ids.back(), 1);
  const std::vector<EventRow> stored = history.load({}).events;
  ASSERT_EQ(stored.size(), 199U);
  EXPECT_EQ(stored.front().effect, 2);
  EXPECT_EQ(stored.front().states.size(), 2U);
  EXPECT_EQ(stored.back().what, "case 198");
  EXPECT_EQ(stored.back().series, events.front().series);
  const std::string before = content_of(database_);
  EXPECT_EQ(history.add_events(std::span(events).first(150).subspan(1)).front(), 2);
  EXPECT_EQ(content_of(database_), before) << "all of it is known";
}

TEST_P(HistoryTest, tells_whether_earlier_nights_are_left_out) {
  History history(database_, kWrite);
  history.add(make_night({.content = "b", .unix_s = 2000}));
  history.add(make_night({.content = "c", .unix_s = 1000, .machine = "other"}));
  EXPECT_TRUE(history.load({}).is_whole);
  EXPECT_TRUE(history.load({.since_unix_s = 1000}).is_whole);
  EXPECT_FALSE(history.load({.since_unix_s = 1500}).is_whole);
  EXPECT_TRUE(history.load({.since_unix_s = 1500, .machine = "farm"}).is_whole);
}

TEST_P(HistoryTest, writers_wait_for_each_other) {
  std::vector<std::thread> writers;
  for (int writer = 0; writer < 4; ++writer)
    writers.emplace_back([&, writer] {
      for (int i = 0; i < 3; ++i) {
        // Each opens anew, so that the schema is made by several at once; every other night is the same of all.
        History history(database_, kWrite);
        history.add(make_night({.content = i == 1 ? "shared" : fmt::format("{} {}", writer, i), .cases = 3 + writer}));
      }
    });
  for (std::thread& writer : writers) writer.join();
  const HistoryView view = History(database_, kRead).load({});
  EXPECT_EQ(view.runs.size(), 9U);
  EXPECT_EQ(view.series.size(), 6U);
}

TEST(HistoryFileTest, reading_writes_nothing) {
  const TempFolder folder;
  const std::string file = (folder / "h.db").string();
  { History(file, kWrite).add(make_night({})); }
  const std::string before = file_text(file);
  EXPECT_EQ(History(file, kRead).load({}).runs.size(), 1U);
  EXPECT_EQ(file_text(file), before);
}

TEST(HistoryServerTest, holds_what_a_file_holds) {
  if (!PostgresServer::is_installed()) GTEST_SKIP() << "there is no PostgreSQL server (Debian's package postgresql)";
  const TempFolder folder;
  const std::string server = PostgresServer::shared().make_database();
  const std::string file = (folder / "h.db").string();
  for (const std::string& database : {server, file}) {
    History history(database, kWrite);
    history.add(make_night({.content = "b", .unix_s = 2000}));
    history.add(make_night({.content = "a", .unix_s = 1000, .cases = 6}));
    history.annotate({.run = 2, .unix_s = 5, .by = "me", .text = "new kernel"});
  }
  EXPECT_EQ(content_of(server), content_of(file));
}

TEST(HistorySourceTest, rows_are_only_appended) {
  for (const auto& entry : std::filesystem::directory_iterator(std::string(RELIEFBENCH_SOURCE_DIR) + "/tuner/history"))
    for (const char* word : {"UPDATE ", "DELETE ", "REPLACE INTO", "DROP ", "TRUNCATE "})
      EXPECT_EQ(file_text(entry.path()).find(word), std::string::npos) << entry.path() << ": " << word;
}

}  // namespace
}  // namespace reliefbench
