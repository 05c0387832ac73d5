// What happens to the built binary: a disk that fills, kills, two starts at once. After each of them the same command,
// given again, ends where an undisturbed run ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/temp_folder.h"
#include "tests/thorough.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

constexpr int kDone = static_cast<int>(Exit::done);
constexpr int kBadInput = static_cast<int>(Exit::bad_input);
constexpr int kEnvironment = static_cast<int>(Exit::environment);

class FaultTest : public ::testing::Test {
 protected:
  FaultTest() {
    std::ofstream(folder_ / "config.json") << R"({
      "scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique", "frame_px": [16, 16]}],
      "measure": {"samples": 2, "batch_ms": 0.01, "warmup_batches_max": 1, "block_cases": 3, "flicker_frames": 0},
      "sweeps": [{"technique": "relief", "axes": {"linear_steps": [4, 8, 16, 32], "refinement": "none"}}]})";
  }
  [[nodiscard]] static std::vector<std::string> sweep(const std::string& output) {
    return {"sweep", "config.json", "-o", output, "--backend", "null", "--quiet"};
  }
  [[nodiscard]] static std::vector<std::string> tune(const std::string& output) {
    return {"tune", "config.json", "-o", output, "--backend", "null", "--quiet"};
  }
  [[nodiscard]] CommandResult run(const std::vector<std::string>& arguments,
                                  const std::map<std::string, std::string>& fault = {}) const {
    return run_reliefbench(arguments, folder_.path(), with(fault));
  }
  [[nodiscard]] static CommandSetting with(const std::map<std::string, std::string>& fault) {
    CommandSetting setting;
    if (fault.empty()) return setting;
    setting.environment = fault;
    setting.environment["LD_PRELOAD"] = RELIEFBENCH_FAULTS;
    return setting;
  }
  static void expect_one_line(const CommandResult& result, int exit_code, const std::string& words) {
    EXPECT_EQ(result.exit_code, exit_code) << "signal " << result.signal << ": " << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  }
  /// Case ids with their statuses, each once.
  [[nodiscard]] std::map<std::string, std::string> statuses(const std::string& output) const {
    std::map<std::string, std::string> all;
    for (const Record& record : load_run(folder_ / output).records) all[record.case_id] = status_id(record.status);
    return all;
  }
  [[nodiscard]] std::size_t lines(const std::string& output, std::string_view file) const {
    return static_cast<std::size_t>(std::ranges::count(file_text(folder_ / output / file), '\n'));
  }
  void expect_whole(const std::string& output) const {
    const reliefbench::Run run = load_run(folder_ / output);
    EXPECT_EQ(lines(output, kResultsFile), 4U);
    ASSERT_EQ(run.records.size(), 4U);
    for (const Record& record : run.records) {
      EXPECT_EQ(record.status, Status::ok) << record.reason;
      EXPECT_EQ(std::ranges::count(run.samples, record.case_id,
                                   [](const Sample& one) -> const std::string& { return one.case_id; }),
                2)
          << record.case_id;
    }
    for (const std::string_view file : {kFrontFile, kTableFile, kT4File, kBenchmarkFile})
      EXPECT_TRUE(std::filesystem::exists(folder_ / output / file)) << file;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / output))
      EXPECT_NE(entry.path().extension(), ".tmp") << entry.path();
    EXPECT_FALSE(std::filesystem::exists(folder_ / output / kMarkFile));
  }
  TempFolder folder_;
};

TEST_F(FaultTest, a_full_disk_is_told_by_one_exit_code_everywhere) {
  ASSERT_EQ(run(sweep("run")).exit_code, kDone);
  ASSERT_EQ(run(tune("tuned")).exit_code, kDone);
  const std::map<std::string, std::string> fault = {
      {"FAULT_CALL", "write"}, {"FAULT_AT", "1"}, {"FAULT_ERRNO", std::to_string(ENOSPC)}, {"FAULT_FILE", "/out"}};
  const std::vector<std::vector<std::string>> commands = {
      {"report", "run", "-o", "out/page.html"},
      {"presets", "run", "-o", "out/presets.json"},
      {"tuners", "run", "--seeds", "1", "--quiet", "-o", "out/page.html"},
      {"bake", "fbm", "--size", "16x16", "--map", "quick", "-o", "out/map.ktx2"},
      {"export", "fbm", "--size", "16x16", "--case", "relief?linear_steps=4", "-o", "out"},
      tune("out")};
  for (const std::vector<std::string>& command : commands) {
    std::filesystem::create_directories(folder_ / "out");
    expect_one_line(run(command, fault), kEnvironment, "No space left on device");
    EXPECT_TRUE(std::filesystem::is_empty(folder_ / "out")) << command.front();
    std::filesystem::remove_all(folder_ / "out");
  }
}

// Killed after the k-th line, temporary file or rename: the same command ends as if nothing had been.
TEST_F(FaultTest, a_kill_at_any_write_loses_nothing) {
  for (const std::string call : {"write", "rename", "pwrite"}) {
    int kills = 0;
    const int every = call == "write" ? tried(5, 1, 8) : 1;
    for (int at = 1;; at += every) {
      const std::string output = "run_" + call + std::to_string(at);
      const CommandResult result = run(sweep(output), {{"FAULT_CALL", call},
                                                       {"FAULT_AT", std::to_string(at)},
                                                       {"FAULT_SIGNAL", std::to_string(SIGKILL)},
                                                       {"FAULT_FILE", "run_"}});
      if (result.exit_code == kDone) break;
      ++kills;
      ASSERT_EQ(result.signal, SIGKILL);
      const CommandResult again = run(sweep(output));
      ASSERT_EQ(again.exit_code, kDone) << output << ": " << again.err;
      expect_whole(output);
    }
    EXPECT_GE(kills, 5) << call;
  }
}

TEST_F(FaultTest, a_merge_is_there_as_a_whole_or_not_at_all) {
  for (const std::string shard : {"1", "2"}) {
    std::vector<std::string> command = sweep("shard_" + shard);
    command.insert(command.end(), {"--shard", shard + "/2"});
    ASSERT_EQ(run(command).exit_code, kDone);
  }
  const auto merge = [](const std::string& output) {
    return std::vector<std::string>{"merge", "shard_1", "shard_2", "-o", output};
  };
  for (const std::string call : {"write", "fsync", "rename"})
    for (const auto& [what, number] : {std::pair{"FAULT_ERRNO", ENOSPC}, std::pair{"FAULT_SIGNAL", SIGKILL}}) {
      int faults = 0;
      for (int at = 1;; at += call == "write" ? 7 : 2) {
        const std::string output = fmt::format("{}_{}_{}", call, what, at);
        const CommandResult result = run(merge(output), {{"FAULT_CALL", call},
                                                         {"FAULT_AT", std::to_string(at)},
                                                         {what, std::to_string(number)},
                                                         {"FAULT_FILE", "/.reliefbench-"}});
        if (result.exit_code == kDone) break;
        ++faults;
        if (result.signal == 0) expect_one_line(result, kEnvironment, "No space left on device");
        if (!std::filesystem::exists(folder_ / output)) {
          ASSERT_EQ(run(merge(output)).exit_code, kDone);
        }
        expect_whole(output);
      }
      EXPECT_GE(faults, 3) << call << " " << what;
    }
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path();
}

TEST_F(FaultTest, an_end_while_samples_are_drawn_costs_no_sample) {
  // The mark of the case is set twice before its first sample: when it is readied and when it is warmed up.
  ASSERT_EQ(run(sweep("run"), {{"FAULT_CALL", "pwrite"},
                               {"FAULT_AT", "4"},
                               {"FAULT_SIGNAL", std::to_string(SIGABRT)},
                               {"FAULT_TEXT", "linear_steps=8&"}})
                .signal,
            SIGABRT);
  const std::string before = file_text(folder_ / "run" / kSamplesFile);
  EXPECT_FALSE(before.empty());
  ASSERT_EQ(run(sweep("run")).exit_code, kDone);
  EXPECT_TRUE(file_text(folder_ / "run" / kSamplesFile).starts_with(before));
  expect_whole("run");
}

// A kill from outside says nothing about the case that was being drawn; only one in which many starts end is left.
TEST_F(FaultTest, kills_in_one_case_are_no_crash_until_they_are_many) {
  const std::map<std::string, std::string> killed = {{"FAULT_CALL", "pwrite"},
                                                     {"FAULT_AT", "0"},
                                                     {"FAULT_SIGNAL", std::to_string(SIGKILL)},
                                                     {"FAULT_TEXT", "linear_steps=8&"}};
  ASSERT_EQ(run(sweep("once"), killed).signal, SIGKILL);
  ASSERT_EQ(run(sweep("once")).exit_code, kDone);
  expect_whole("once");
  for (int times = 0; times < 4; ++times) ASSERT_EQ(run(sweep("often"), killed).signal, SIGKILL) << times;
  const CommandResult last = run(sweep("often"), killed);
  EXPECT_EQ(last.exit_code, kDone);
  EXPECT_THAT(last.out, HasSubstr("1 crashed 3 ok"));
}

TEST_F(FaultTest, tune_leaves_a_setting_in_which_many_starts_end) {
  const std::map<std::string, std::string> killed = {{"FAULT_CALL", "pwrite"},
                                                     {"FAULT_AT", "0"},
                                                     {"FAULT_SIGNAL", std::to_string(SIGKILL)},
                                                     {"FAULT_TEXT", "linear_steps=8&"}};
  for (int start = 0; start < 4; ++start) ASSERT_EQ(run(tune("run"), killed).signal, SIGKILL) << start;
  std::vector<std::string> json = tune("run");
  json.emplace_back("--json");
  const CommandResult last = run(json, killed);
  ASSERT_EQ(last.exit_code, kDone) << last.err;
  const nlohmann::json answer = nlohmann::json::parse(last.out);
  EXPECT_EQ(answer.at("space").at("failed"), 1);
  EXPECT_EQ(answer.at("space").at("scored"), 3);
}

TEST_F(FaultTest, of_starts_at_once_one_measures_and_nothing_is_lost_or_doubled) {
  for (int round = 0; round < 8; ++round) {
    const std::string output = "round" + std::to_string(round) + "/run";
    std::vector<pid_t> children;
    std::vector<CommandSetting> settings(6);
    for (std::size_t i = 0; i < settings.size(); ++i) {
      settings[i].stdout_file = "out" + std::to_string(i);
      settings[i].stderr_file = "err" + std::to_string(i);
      children.push_back(start_reliefbench(sweep(output), folder_.path(), settings[i]));
    }
    int done = 0;
    for (std::size_t i = 0; i < settings.size(); ++i) {
      const CommandResult result = wait_for(children[i], folder_.path(), settings[i]);
      if (result.exit_code == kDone)
        ++done;
      else
        expect_one_line(result, kBadInput, "another process is writing to it");
    }
    EXPECT_GE(done, 1);
    expect_whole(output);
  }
}

TEST_F(FaultTest, results_that_are_removed_under_a_run_are_no_success) {
  const std::string results = "run/results.jsonl";
  const CommandResult result = run(
      sweep("run"), {{"FAULT_CALL", "write"}, {"FAULT_AT", "2"}, {"FAULT_UNLINK", results}, {"FAULT_FILE", results}});
  expect_one_line(result, kEnvironment, "its record is gone");
  ASSERT_EQ(run(sweep("run")).exit_code, kDone);
  EXPECT_EQ(statuses("run").size(), 4U);
}

TEST_F(FaultTest, killed_before_its_first_file_stands_a_run_goes_on) {
  ASSERT_EQ(run(sweep("run"), {{"FAULT_CALL", "open"},
                               {"FAULT_AT", "1"},
                               {"FAULT_SIGNAL", std::to_string(SIGKILL)},
                               {"FAULT_FILE", "run/.reliefbench-"}})
                .signal,
            SIGKILL);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run" / kRunFile));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "run" / kResultsFile));
  const CommandResult again = run(sweep("run"));
  EXPECT_EQ(again.exit_code, kDone) << again.err;
  expect_whole("run");
}

TEST_F(FaultTest, an_export_that_was_killed_is_done_again) {
  const auto export_of = [](const std::string& id, const std::string& output) {
    return std::vector<std::string>{"export", "fbm", "--size", "16x16", "--case", id, "-o", output};
  };
  const auto names_in = [&](const std::string& output) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / output))
      names.insert(entry.path().filename());
    return names;
  };
  ASSERT_EQ(run(export_of("relief", "whole")).exit_code, kDone);
  ASSERT_EQ(run(export_of("max_mip", "other")).exit_code, kDone);
  std::size_t kills = 0;
  for (int at = 1;; ++at) {
    const std::string output = "out" + std::to_string(at);
    const std::map<std::string, std::string> fault = {{"FAULT_CALL", "rename"},
                                                      {"FAULT_AT", std::to_string(at)},
                                                      {"FAULT_SIGNAL", std::to_string(SIGKILL)},
                                                      {"FAULT_FILE", output}};
    const bool is_killed = run(export_of("max_mip", output), fault).signal == SIGKILL;
    kills += is_killed ? 1U : 0U;
    // Over what the killed one left, one without the extra texture, which is killed, too, and then done.
    static_cast<void>(run(export_of("relief", output), fault));
    const CommandResult last = run(export_of("relief", output));
    ASSERT_EQ(last.exit_code, kDone) << at << ": " << last.err;
    EXPECT_EQ(names_in(output), names_in("whole")) << at;
    for (const std::string& name : names_in("whole"))
      EXPECT_EQ(file_text(folder_ / output / name), file_text(folder_ / "whole" / name)) << at;
    if (!is_killed) break;
  }
  EXPECT_EQ(kills, names_in("other").size()) << "one a file";
}

TEST_F(FaultTest, a_message_is_one_line_whatever_is_in_it) {
  const std::string hostile = "a\n\x1b[31mb";
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {hostile},
           {"sweep", hostile, "-o", "run", "--backend", "null"},
           {"sweep", "config.json", "-o", "run", "--backend", hostile},
           {"sweep", "config.json", "-o", "run", "--backend", "null", "--filter", hostile},
           {"recommend", hostile},
           {"report", hostile},
           {"recommend", "x", "--" + hostile},
           {"sweep", std::string(100'000, 'x'), "-o", "run", "--backend", "null"}}) {
    const CommandResult result = run(command);
    expect_one_line(result, kBadInput, "reliefbench: ");
    EXPECT_EQ(result.err.find('\x1b'), std::string::npos) << result.err;
    EXPECT_LT(result.err.size(), 1200U);
  }
  std::ofstream(folder_ / "key.json") << R"({"a\nb\u001b[31m": 1})";
  expect_one_line(run({"sweep", "key.json", "-o", "run", "--backend", "null"}), kBadInput, "key.json:1");
}

TEST_F(FaultTest, output_that_nobody_takes_is_told) {
  CommandSetting full;
  full.stdout_file = "/dev/full";
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"--help"}, {"--version"}, {"sweep", "--help"}, {"list", "techniques"}})
    expect_one_line(run_reliefbench(command, folder_.path(), full), kEnvironment, "No space left on device");
  CommandSetting mute;
  mute.stderr_file = "/dev/full";
  EXPECT_EQ(run_reliefbench({"sweep", "none.json"}, folder_.path(), mute).exit_code, kBadInput);
  EXPECT_EQ(run_reliefbench({"sweep", "config.json", "-o", "run", "--backend", "null"}, folder_.path(), mute).exit_code,
            kDone);
}

TEST_F(FaultTest, too_few_descriptors_or_threads_give_one_line) {
  for (const rlim_t files : {8, 16, 63}) {
    CommandSetting few;
    few.before_start = [files] {
      const rlimit limit{.rlim_cur = files, .rlim_max = files};
      setrlimit(RLIMIT_NOFILE, &limit);
    };
    expect_one_line(run_reliefbench(sweep("run"), folder_.path(), few), kEnvironment, "ulimit -n");
  }
  for (const char* at : {"0", "1", "2"}) {
    const CommandResult threads = run(
        sweep("run"), {{"FAULT_CALL", "pthread_create"}, {"FAULT_AT", at}, {"FAULT_ERRNO", std::to_string(EAGAIN)}});
    if (threads.exit_code != kDone) expect_one_line(threads, kEnvironment, "");
    std::filesystem::remove_all(folder_ / "run");
  }
}

TEST_F(FaultTest, endless_input_is_refused) {
  expect_one_line(run({"sweep", "/dev/zero", "-o", "run", "--backend", "null"}), kBadInput, "/dev/zero: is a device");
}

}  // namespace
}  // namespace reliefbench
