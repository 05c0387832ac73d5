// Forty nights of the null device from the command line, as a team would run them, on both kinds of database.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/command.h"
#include "tests/history_rig.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::SizeIs;

constexpr int kNights = 40;
constexpr int kSlowFrom = 25;

class NightlyTest : public OnBothDatabases {
 protected:
  [[nodiscard]] CommandResult run(std::vector<std::string> arguments) const {
    return run_reliefbench(std::move(arguments), folder_.path());
  }

  /// One night; each has its own order of cases, so its own noise.
  [[nodiscard]] CommandResult night(int index, const std::vector<std::string>& more = {}) const {
    std::string config = file_text(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs/smoke.json");
    config.insert(config.find("\"name\""), fmt::format("\"seed\": {}, ", index + 1));
    std::ofstream(folder_ / "night.json") << config;
    std::vector<std::string> arguments = {"track",
                                          "night",
                                          "night.json",
                                          "--db",
                                          database_,
                                          "--quiet",
                                          "--json",
                                          "--backend",
                                          "null",
                                          "-o",
                                          fmt::format("nights/{}", index),
                                          "--time",
                                          fmt::format("@{}", 1'767'225'600 + 86400 * index),
                                          "--commit",
                                          fmt::format("c{}", index),
                                          "--machine",
                                          "null-1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(std::move(arguments));
  }
};

/// What the kind of database has no part in.
class NightlyOnAFileTest : public NightlyTest {};

json open_events(const CommandResult& result) {
  json open = json::array();
  const json check = json::parse(result.out);
  for (const json& event : check.at("events"))
    if (event.at("open").get<bool>()) open.push_back(event);
  return open;
}

TEST_P(NightlyTest, a_technique_that_gets_slower_is_one_alert) {
  int first_alert = 0;
  for (int index = 0; index < kNights; ++index) {
    const CommandResult result =
        night(index, index < kSlowFrom ? std::vector<std::string>{}
                                       : std::vector<std::string>{"--inject-slowdown", "relaxed_cone:1.05"});
    ASSERT_THAT(result.exit_code, testing::AnyOf(0, 1)) << result.err;
    if (result.exit_code == 1 && first_alert == 0) first_alert = index;
    if (result.exit_code == 1) {
      ASSERT_THAT(open_events(result), SizeIs(1)) << "night " << index;
    }
  }
  EXPECT_GE(first_alert, kSlowFrom + 3);
  EXPECT_LE(first_alert, kSlowFrom + 4);

  const CommandResult result = run({"track", "check", "--db", database_, "--json", "--junit", "news.xml"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(schema_errors(json::parse(result.out), "track_check"), "");
  const json open = open_events(result);
  ASSERT_THAT(open, SizeIs(1));
  EXPECT_THAT(open[0].at("what").get<std::string>(), HasSubstr("technique=relaxed_cone"));
  EXPECT_EQ(open[0].at("kind"), "slower");
  EXPECT_EQ(open[0].at("state"), "confirmed");
  EXPECT_LE(open[0].at("interval")[0].get<double>(), 0.05);
  EXPECT_GE(open[0].at("interval")[1].get<double>(), 0.05);
  EXPECT_EQ(open[0].at("good").at("commit"), fmt::format("c{}", kSlowFrom - 1));
  EXPECT_EQ(open[0].at("bad").at("commit"), fmt::format("c{}", kSlowFrom));
  EXPECT_THAT(file_text(folder_ / "news.xml"), HasSubstr("failures=\"1\""));

  // It was told: no further mail. Once it is accepted, the night is green again.
  EXPECT_EQ(run({"track", "check", "--db", database_, "--news"}).exit_code, 0);
  const std::string id = std::to_string(open[0].at("id").get<int>());
  EXPECT_EQ(run({"track", "accept", "--db", database_, "--event", id, "--by", "ann"}).exit_code, 0);
  EXPECT_EQ(run({"track", "check", "--db", database_}).exit_code, 0);

  EXPECT_EQ(run({"track", "report", "--db", database_, "-o", "trend.html"}).exit_code, 0);
  EXPECT_THAT(file_text(folder_ / "trend.html"), HasSubstr("relaxed_cone"));
}

TEST_P(NightlyOnAFileTest, no_change_is_no_alert) {
  for (int index = 0; index < kNights; ++index) {
    const CommandResult result = night(index);
    ASSERT_EQ(result.exit_code, 0) << "night " << index << ": " << result.out << result.err;
  }
}

TEST_P(NightlyTest, no_night_is_no_answer) {
  const CommandResult result = run({"track", "check", "--db", database_});
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("track ingest"));
}

TEST_P(NightlyOnAFileTest, builds_that_are_measured_again_settle_a_suspect) {
  for (int index = 0; index < 16; ++index) {
    const bool is_slow = index >= 12;
    (void)night(index,
                is_slow ? std::vector<std::string>{"--inject-slowdown", "cone:1.08"} : std::vector<std::string>{});
  }
  const json open = open_events(run({"track", "check", "--db", database_, "--json"}));
  ASSERT_THAT(open, SizeIs(1));
  ASSERT_EQ(open[0].at("state"), "suspect");
  const std::string id = std::to_string(open[0].at("id").get<int>());
  const std::string sweep =
      fmt::format("{} sweep night.json --backend null --quiet -o $OUT >>log.txt", RELIEFBENCH_BINARY);
  const auto confirm = [&](const std::string& bad, const std::string& folder) {
    return run({"track", "confirm", "--db", database_, "--event", id, "--good", sweep, "--bad", bad, "--rounds", "2",
                "-o", folder, "--quiet", "--json"});
  };
  CommandResult result = confirm(sweep, "same");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(json::parse(result.out).at("state"), "cleared");
  EXPECT_EQ(run({"track", "check", "--db", database_}).exit_code, 0);

  result = confirm(sweep + " --inject-slowdown cone:1.08", "slow");
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_EQ(json::parse(result.out).at("state"), "confirmed");
  EXPECT_EQ(run({"track", "check", "--db", database_}).exit_code, 1);

  // Without a folder of their own, re-runs of other commands are others.
  const auto confirm_there = [&](const std::string& bad) {
    return run({"track", "confirm", "--db", database_, "--event", id, "--good", sweep, "--bad", bad, "--rounds", "2",
                "--quiet", "--json"});
  };
  EXPECT_EQ(json::parse(confirm_there(sweep).out).at("state"), "cleared");
  EXPECT_EQ(json::parse(confirm_there(sweep + " --inject-slowdown cone:1.08").out).at("state"), "confirmed");
  const std::filesystem::directory_iterator folders(folder_ / "out/confirm");
  for (const std::filesystem::path& folder : folders)
    EXPECT_THAT(folder.filename().string(), testing::MatchesRegex(id + "-[0-9a-f]{8}"));

  result = confirm("exit 7", "broken");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("'exit 7' ended with exit code 7"));
}

INSTANTIATE_TEST_SUITE_P(Databases, NightlyTest, kBothDatabases, database_kind);
INSTANTIATE_TEST_SUITE_P(File, NightlyOnAFileTest, ::testing::Values("sqlite"), database_kind);

}  // namespace
}  // namespace reliefbench
