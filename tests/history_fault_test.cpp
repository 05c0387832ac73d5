// What happens to `track ingest` on the way: kills, a full disk, two at once, files that may only be read, a server
// that goes away. After each of them the same command, given again, ends where an undisturbed one ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <random>
#include <thread>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tests/history_rig.h"
#include "tests/thorough.h"
#include "tests/written_run.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

constexpr uid_t kNobody = 65534;

class HistoryFaultTest : public OnBothDatabases {
 protected:
  void SetUp() override {
    OnBothDatabases::SetUp();
    for (int night = 1; night <= 3; ++night) {
      reliefbench::Run run = sampled_run({.folder = folder_ / ("night" + std::to_string(night)),
                                          .backends = {"vulkan"},
                                          .scenes = {"rocks/oblique"},
                                          .cases = 40,
                                          .slowness = 1 + 0.1 * night});
      run.info["host"]["name"] = "farm";
      run.info["started"] = "2026-11-2" + std::to_string(night) + "T12:00:00Z";
      write_run(run);
    }
    ingest(make_undisturbed());
  }
  [[nodiscard]] static std::vector<std::string> command(const std::string& database) {
    return {"track", "ingest", "night1", "night2", "night3", "--db", database};
  }
  void ingest(const std::string& database) const {
    const CommandResult result = run_reliefbench(command(database), folder_.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  const std::string& make_undisturbed() { return undisturbed_ = make_database(); }
  void expect_as_undisturbed(const std::string& database) const {
    EXPECT_EQ(content_of(database), content_of(undisturbed_));
  }
  static void expect_one_line(const CommandResult& result, int exit_code, const std::string& words) {
    EXPECT_EQ(result.exit_code, exit_code) << "signal " << result.signal << ": " << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  }
  [[nodiscard]] static CommandSetting with(const std::map<std::string, std::string>& fault) {
    CommandSetting setting{.environment = fault};
    setting.environment["LD_PRELOAD"] = RELIEFBENCH_FAULTS;
    return setting;
  }

 private:
  std::string undisturbed_;
};
INSTANTIATE_TEST_SUITE_P(Both, HistoryFaultTest, kBothDatabases, database_kind);

// Kills at moments spread over the time that an undisturbed command takes, as the machine is now: five of six meet it
// alive. The database is made anew where it is whole, so that its first moments count as often as its last.
TEST_P(HistoryFaultTest, kills_lose_and_double_nothing) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  ingest(make_database());
  double whole_ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  std::mt19937 random(1);
  const int kills = is_server() ? tried(10, 40, 5) : tried(30, 160, 10);  // a server's databases take longer to make
  int killed = 0;
  for (int starts = 0; killed < kills; ++starts) {
    ASSERT_LT(starts, 4 * kills) << "only " << killed << " of them met the command alive";
    const pid_t child = start_reliefbench(command(database_), folder_.path());
    std::this_thread::sleep_for(
        std::chrono::duration<double, std::milli>(std::uniform_real_distribution(0.0, 1.0)(random) * whole_ms));
    kill(child, SIGKILL);
    const bool is_killed = wait_for(child, folder_.path()).signal == SIGKILL;
    killed += is_killed ? 1 : 0;
    whole_ms *= is_killed ? 1.02 : 0.9;
    if (is_killed && killed % 10 != 0) continue;  // go on with what it left
    ingest(database_);
    expect_as_undisturbed(database_);
    database_ = make_database();
  }
}

TEST_P(HistoryFaultTest, two_at_once_do_what_one_does) {
  const pid_t first =
      start_reliefbench(command(database_), folder_.path(), {.stdout_file = "1.out", .stderr_file = "1.err"});
  const pid_t second =
      start_reliefbench(command(database_), folder_.path(), {.stdout_file = "2.out", .stderr_file = "2.err"});
  std::string said;
  for (const auto& [child, name] : {std::pair(first, "1"), std::pair(second, "2")}) {
    const std::string number = name;
    const CommandResult result =
        wait_for(child, folder_.path(), {.stdout_file = number + ".out", .stderr_file = number + ".err"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    said += result.out;
  }
  for (const char* night : {"night1: run", "night2: run", "night3: run"})
    EXPECT_EQ(said.find(night), said.rfind(night)) << "imported once: " << said;
  const HistoryView view = History(database_, History::Access::read).load({});
  EXPECT_EQ(view.runs.size(), 3U);
  for (const std::vector<RepetitionRow>& nights : view.nights) EXPECT_EQ(nights.size(), 3U);
}

class HistoryFileFaultTest : public HistoryFaultTest {};
INSTANTIATE_TEST_SUITE_P(File, HistoryFileFaultTest, ::testing::Values("sqlite"), database_kind);

// SQLite writes by pwrite: killed after each of them, in a loop, until there is no further one.
TEST_P(HistoryFileFaultTest, a_kill_after_any_write_loses_nothing) {
  int kills = 0;
  for (int at = 1;; at += 1 + at / 8) {
    const std::string database = make_database();
    const CommandResult result = run_reliefbench(command(database), folder_.path(),
                                                 with({{"FAULT_CALL", "pwrite"},
                                                       {"FAULT_AT", std::to_string(at)},
                                                       {"FAULT_SIGNAL", std::to_string(SIGKILL)},
                                                       {"FAULT_FILE", ".db"}}));
    if (result.exit_code == 0) break;
    ++kills;
    ASSERT_EQ(result.signal, SIGKILL) << result.err;
    ingest(database);
    expect_as_undisturbed(database);
  }
  EXPECT_GE(kills, 20);
}

// Some writes SQLite can do without: those of the last checkpoint, for the log has it all.
TEST_P(HistoryFileFaultTest, a_disk_that_is_full_at_any_write_is_told_in_a_line) {
  int faults = 0;
  for (int at = 1; at < 200; at += 1 + at / 4) {
    const std::string database = make_database();
    const CommandResult result = run_reliefbench(command(database), folder_.path(),
                                                 with({{"FAULT_CALL", "pwrite"},
                                                       {"FAULT_AT", std::to_string(at)},
                                                       {"FAULT_ERRNO", std::to_string(ENOSPC)},
                                                       {"FAULT_FILE", ".db"}}));
    if (result.exit_code != 0) {
      ++faults;
      expect_one_line(result, 3, "No space left on device");
      ingest(database);
    }
    expect_as_undisturbed(database);
  }
  EXPECT_GE(faults, 10);
}

TEST_P(HistoryFileFaultTest, a_limit_on_file_size_is_a_full_disk) {
  CommandSetting setting;
  setting.before_start = [] {
    const rlimit limit{.rlim_cur = 60'000, .rlim_max = 60'000};
    setrlimit(RLIMIT_FSIZE, &limit);
  };
  expect_one_line(run_reliefbench(command(database_), folder_.path(), setting), 3, database_);
  ingest(database_);
  expect_as_undisturbed(database_);
}

TEST_P(HistoryFileFaultTest, a_file_that_may_only_be_read_is_read) {
  ingest(database_);
  const std::string before = content_of(database_);
  for (const char* side : {"-wal", "-shm"}) std::filesystem::remove(database_ + side);
  chmod(database_.c_str(), 0444);
  const std::filesystem::path folder = folder_.path();
  CommandSetting setting;
  setting.before_start = [&] {
    if (geteuid() == 0 && setuid(kNobody) != 0) _exit(126);  // root may do anything
  };
  for (const mode_t mode : {0755, 0555}) {
    chmod(folder.c_str(), mode);
    const CommandResult listed = run_reliefbench({"track", "list", "runs", "--db", database_}, folder, setting);
    EXPECT_EQ(listed.exit_code, 0) << listed.err;
    EXPECT_THAT(listed.out, HasSubstr("night1"));
    expect_one_line(
        run_reliefbench({"track", "annotate", "--run", "1", "--text", "x", "--db", database_}, folder, setting), 3,
        "may only be read");
  }
  chmod(folder.c_str(), 0755);
  EXPECT_EQ(content_of(database_), before);
}

TEST_P(HistoryFileFaultTest, a_damaged_file_is_told) {
  ingest(database_);
  {
    std::fstream file(database_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(4096 * 3);
    file << std::string(60'000, '\xA5');
  }
  expect_one_line(run_reliefbench({"track", "list", "runs", "--db", database_}, folder_.path()), 2, "is damaged");
}

// Both databases, but a test's own server.
TEST(HistoryServerFaultTest, a_server_that_goes_away_is_told_and_loses_nothing) {
  if (!PostgresServer::is_installed()) GTEST_SKIP() << "there is no PostgreSQL server (Debian's package postgresql)";
  PostgresServer server;
  const std::string database = server.make_database();
  const Night first = make_night({.content = "first"});
  {
    History history(database, History::Access::write);
    history.add(first);
    server.stop();
    for (const bool reads : {true, false}) {
      try {
        reads ? static_cast<void>(history.load({})) : static_cast<void>(history.add(make_night({.content = "second"})));
        ADD_FAILURE() << "expected an error";
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), Exit::environment);
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      }
    }
  }
  const TempFolder folder;
  const CommandResult absent = run_reliefbench({"track", "list", "runs", "--db", database}, folder.path());
  EXPECT_EQ(absent.exit_code, 3);
  EXPECT_EQ(std::ranges::count(absent.err, '\n'), 1) << absent.err;
  server.start();
  History history(database, History::Access::write);
  EXPECT_EQ(history.add(first), std::nullopt);
  EXPECT_EQ(history.add(make_night({.content = "second"})), 2);
}

// Stopped in the middle of a night: of a big one, so that there is a middle.
TEST(HistoryServerFaultTest, a_server_that_is_stopped_amid_a_night_keeps_none_of_it) {
  if (!PostgresServer::is_installed()) GTEST_SKIP() << "there is no PostgreSQL server (Debian's package postgresql)";
  PostgresServer server;
  const std::string database = server.make_database();
  History(database, History::Access::write).add(make_night({.content = "first"}));
  const Night big = make_night({.content = "big", .cases = 4000});
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    server.stop();
  });
  EXPECT_THROW(History(database, History::Access::write).add(big), Error);
  stopper.join();
  server.start();
  EXPECT_EQ(History(database, History::Access::read).load({}).runs.size(), 1U);
  EXPECT_EQ(History(database, History::Access::write).add(big), 2);
}

TEST(HistoryServerFaultTest, without_its_part_of_soci_the_package_is_named) {
  const TempFolder folder;
  std::ofstream(folder / "libsoci_postgresql.so.4.0") << "no library";
  const CommandResult result = run_reliefbench(
      {"track", "list", "runs", "--db", "postgresql://localhost/x"}, folder.path(),
      {.environment = {{"LD_LIBRARY_PATH", folder.path().string()}, {"SOCI_BACKENDS_PATH", folder.path().string()}}});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("libsoci-postgresql4.0"));
}

}  // namespace
}  // namespace reliefbench
