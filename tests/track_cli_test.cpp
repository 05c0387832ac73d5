// `reliefbench track`: ingest, list, annotate, export, on both databases.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tests/history_rig.h"
#include "tests/schema.h"
#include "tests/written_run.h"
#include "tuner/results/csv.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class TrackCliTest : public OnBothDatabases {
 protected:
  void SetUp() override {
    OnBothDatabases::SetUp();
    for (const auto& [name, slowness] : {std::pair("night1", 1.0), std::pair("night2", 1.1)}) {
      reliefbench::Run run =
          sampled_run({.folder = folder_ / name, .backends = {"vulkan"}, .cases = 3, .slowness = slowness});
      run.info["host"]["name"] = "farm";
      run.info["started"] = slowness == 1 ? "2026-11-22T12:00:00Z" : "2026-11-23T12:00:00Z";
      write_run(run);
    }
  }
  /// `track ARGUMENTS --db DATABASE`
  [[nodiscard]] CommandResult track(std::vector<std::string> arguments, const CommandSetting& setting = {}) const {
    arguments.insert(arguments.begin(), "track");
    arguments.insert(arguments.end(), {"--db", database_});
    return run_reliefbench(arguments, folder_.path(), setting);
  }
  std::string output(const std::vector<std::string>& arguments) const {
    const CommandResult result = track(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  }
  [[nodiscard]] json listed(const std::string& what) const {
    json rows = json::parse(output({"list", what, "--json"}));
    EXPECT_EQ(schema_errors({{what, rows}}, "track"), "");
    return rows;
  }
};
INSTANTIATE_TEST_SUITE_P(Both, TrackCliTest, kBothDatabases, database_kind);

TEST_P(TrackCliTest, imports_what_is_new_and_refuses_the_rest_alone) {
  std::filesystem::create_directories(folder_ / "stress");
  const CommandResult first = track({"ingest", "night1", "stress", "none", "night2"});
  EXPECT_EQ(first.exit_code, 2);
  EXPECT_THAT(first.out, HasSubstr("night1: run 1, 33 cases\nnight2: run 2, 33 cases\n"));
  EXPECT_THAT(first.err, HasSubstr("reliefbench: stress: is no run of sweep or tune"));
  EXPECT_THAT(first.err, HasSubstr("reliefbench: none: "));
  EXPECT_EQ(std::ranges::count(first.err, '\n'), 2);
  const std::string before = content_of(database_);
  EXPECT_EQ(output({"ingest", "night2", "night1/"}), "night2: is there already\nnight1/: is there already\n");
  EXPECT_EQ(content_of(database_), before);

  const json imports = json::parse(track({"ingest", "night1", "none", "--json"}).out);
  EXPECT_EQ(schema_errors({{"ingest", imports}}, "track"), "");
  EXPECT_EQ(imports[0]["state"], "known");
  EXPECT_EQ(imports[1]["state"], "refused");
}

// A clock that was set back made an improvement of a regression, without a word.
TEST_P(TrackCliTest, says_of_a_night_that_others_are_later) {
  EXPECT_EQ(output({"ingest", "night1"}), "night1: run 1, 33 cases\n");
  const std::vector<std::string> early = {"ingest", "night2", "--time", "2026-11-01T12:00:00Z"};
  EXPECT_EQ(output(early), "night2: run 2, 33 cases\n  1 run of farm is later: is its clock right?\n");
  database_ = make_database();
  output({"ingest", "night1"});
  EXPECT_EQ(output({"ingest", "night2", "--machine", "another", "--time", "2026-11-01T12:00:00Z"}),
            "night2: run 2, 33 cases\n");
  database_ = make_database();
  output({"ingest", "night1"});
  const json imports = json::parse(output({"ingest", "night2", "--json", "--time", "2026-11-01T12:00:00Z"}));
  EXPECT_EQ(schema_errors({{"ingest", imports}}, "track"), "");
  EXPECT_EQ(imports[0]["doubt"], "1 run of farm is later: is its clock right?");
}

TEST_P(TrackCliTest, labels_a_night) {
  EXPECT_EQ(track({"ingest", "night1", "--time", "yesterday"}).exit_code, 2);
  output(
      {"ingest", "night1", "--time", "2020-01-02T03:04:05Z", "--commit", "abc", "--parent", "def", "--machine", "m 1"});
  const json run = listed("runs")[0];
  EXPECT_EQ(run["time"], "2020-01-02T03:04:05Z");
  EXPECT_EQ(run["commit"], "abc");
  EXPECT_EQ(run["parent"], "def");
  EXPECT_EQ(run["machine"], "m 1");
}

TEST_P(TrackCliTest, lists_what_a_history_holds) {
  output({"ingest", "night1", "night2"});
  const json runs = listed("runs");
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(runs[0]["machine"], "farm");
  EXPECT_EQ(runs[0]["valid"], 9);
  EXPECT_EQ(runs[0]["series"], 33);
  EXPECT_EQ(listed("series").size(), 33U);
  EXPECT_EQ(listed("machines")[0]["runs"], 2);
  EXPECT_TRUE(listed("events").empty());
  EXPECT_THAT(output({"list", "runs"}), HasSubstr("15450c1"));
  EXPECT_THAT(output({"list", "series"}), HasSubstr("frame_time"));
  EXPECT_THAT(output({"list", "events"}), HasSubstr("no events"));
  EXPECT_EQ(json::parse(output({"list", "runs", "--json", "--since", "2026-11-23T00:00:00Z"})).size(), 1U);
  const CommandResult bad = track({"list", "everything"});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_EQ(std::ranges::count(bad.err, '\n'), 1) << bad.err;
}

TEST_P(TrackCliTest, lists_events_that_a_check_left) {
  output({"ingest", "night1", "night2"});
  EventRow event;
  event.key = "k";
  event.machine = "farm";
  event.kind = "slower";
  event.what = "vulkan technique=cone\x1b[31m";
  event.good_run = 1;
  event.bad_run = 2;
  event.effect = 0.1;
  event.low = 0.05;
  event.high = 0.15;
  event.series = {1, 2};
  event.states = {{.unix_s = 1, .state = EventState::suspect, .by = "check", .text = "seen"}};
  History(database_, History::Access::write).add_events(std::span(&event, 1));
  EXPECT_EQ(listed("events")[0]["states"].size(), 1U);
  const std::string text = output({"list", "events"});
  EXPECT_THAT(text, HasSubstr("suspect"));
  EXPECT_THAT(text, HasSubstr("+10.0 % [+5.0, +15.0]"));
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
  output({"annotate", "--event", "1", "--text", "known"});
  EXPECT_EQ(listed("events")[0]["annotations"][0]["text"], "known");
}

TEST_P(TrackCliTest, annotates_what_there_is) {
  if (!is_server()) {
    EXPECT_EQ(track({"annotate", "--run", "1", "--text", "x"}).exit_code, 5);
    EXPECT_FALSE(std::filesystem::exists(database_)) << "which is not made for it";
  }
  output({"ingest", "night1"});
  output({"annotate", "--run", "1", "--text", "new\nkernel \x1b[1m", "--by", "me"});
  const json note = listed("runs")[0]["annotations"][0];
  EXPECT_EQ(note["text"], "new\nkernel \x1b[1m");
  EXPECT_EQ(note["by"], "me");
  EXPECT_THAT(output({"list", "runs"}), HasSubstr("new\\nkernel"));
  for (const std::vector<std::string>& bad : {std::vector<std::string>{"annotate", "--run", "7", "--text", "x"},
                                              {"annotate", "--text", "x"},
                                              {"annotate", "--run", "1", "--text", ""},
                                              {"annotate", "--run", "1", "--event", "1", "--text", "x"}}) {
    const CommandResult result = track(bad);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
  }
}

TEST_P(TrackCliTest, exports_a_night_as_google_benchmark_that_it_reads_again) {
  output({"ingest", "night1", "night2"});
  output({"export", "--format", "gbench", "--run", "1", "-o", "one.json"});
  EXPECT_EQ(json::parse(file_text(folder_ / "one.json"))["context"]["host_name"], "farm");
  database_ = make_database();
  output({"ingest", "one.json"});
  output({"export", "--format", "gbench", "-o", "two.json"});
  database_ = make_database();
  output({"ingest", "two.json"});
  const HistoryView view = History(database_, History::Access::read).load({.with_samples = true});
  const reliefbench::Run run = load_run(folder_ / "night1");
  const SamplesByCase samples = group_samples(run.samples);
  int times = 0;
  for (std::size_t i = 0; i < view.series.size(); ++i) {
    const SeriesRow& series = view.series[i];
    const RepetitionRow& row = view.nights[i].front();
    const auto found = samples.find(series.case_id);
    EXPECT_EQ(row.is_valid, found != samples.end()) << series.case_id;
    if (series.metric != "real_time" || found == samples.end()) continue;
    ++times;
    EXPECT_EQ(row.samples, raw_times(found->second)) << "to the last bit";
  }
  EXPECT_EQ(times, 9);
}

TEST_P(TrackCliTest, exports_for_other_trackers) {
  output({"ingest", "night1", "night2"});
  const json bencher = json::parse(output({"export", "--format", "bencher", "--run", "1"}));
  EXPECT_EQ(bencher.size(), 9U) << "valid cases";
  for (const auto& [name, measures] : bencher.items()) {
    EXPECT_LT(measures["latency"]["lower_value"], measures["latency"]["value"]);
    EXPECT_GT(measures["relative-time"]["upper_value"], measures["relative-time"]["value"]);
  }
  const json action = json::parse(output({"export", "--format", "github-action"}));
  ASSERT_EQ(action.size(), 9U);
  EXPECT_TRUE(action[0]["name"].is_string() && action[0]["unit"].is_string() && action[0]["value"].is_number());
  const std::vector<CsvRow> rows = parse_csv(output({"export", "--format", "otava-csv"}), "csv");
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].cells.size(), 2U + 33U);
  EXPECT_EQ(rows[0].cells[0], "time");
  EXPECT_EQ(rows[1].cells[0], "2026-11-22T12:00:00Z");
  EXPECT_NEAR(std::stod(rows[2].cells[2]) / std::stod(rows[1].cells[2]), 1.1, 0.02);
  EXPECT_EQ(track({"export", "--format", "bencher", "--run", "9"}).exit_code, 5);
  EXPECT_EQ(track({"export", "--format", "xml"}).exit_code, 2);
}

TEST(TrackHelpTest, every_subcommand_has_help_with_an_example) {
  const TempFolder folder;
  const CommandResult all = run_reliefbench({"track", "--help"}, folder.path());
  for (const std::string name : {"ingest", "list", "annotate", "export"}) {
    EXPECT_THAT(all.out, HasSubstr("\n  " + name));
    const CommandResult one = run_reliefbench({"track", name, "--help"}, folder.path());
    EXPECT_EQ(one.exit_code, 0);
    EXPECT_THAT(one.out, HasSubstr("Example:\n  reliefbench track " + name));
  }
  EXPECT_EQ(run_reliefbench({"track"}, folder.path()).exit_code, 2);
}

}  // namespace
}  // namespace reliefbench
