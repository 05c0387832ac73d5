// Whatever the system refuses, at whichever call: a command that cannot go on says why in a line and leaves nothing
// torn, one that can leaves what an undisturbed one leaves, and the same command, given again, always does. So it is
// with one that is killed, before or after a call. Under a sanitizer a part of the calls is tried.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cerrno>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "backends/backend.h"
#include "backends/worker/remote.h"
#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "tests/command_server.h"
#include "tests/history_rig.h"
#include "tests/temp_folder.h"
#include "tests/thorough.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

/// Of four cases; of 24 where all is asked for. Their times are far enough apart for the null device's noise, which no
/// two runs share, to change nothing about which of them have pictures.
std::string small_config() {
  const std::string steps = is_thorough() ? "[4, 5, 6, 8, 10, 12, 14, 17, 20, 24, 28, 33, 40, 48, 57, 68, 82, 98, "
                                            "118, 142, 170, 204, 245, 294]"
                                          : "[4, 8, 16, 32]";
  return R"({
    "scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique", "frame_px": [16, 16]}],
    "measure": {"samples": 2, "batch_ms": 0.01, "warmup_batches_max": 1, "block_cases": 3, "flicker_frames": 0},
    "sweeps": [{"technique": "relief", "axes": {"refinement": "none", "linear_steps": )" +
         steps + "}}]}";
}

struct IoFault {
  const char* id;
  const char* call;
  std::map<std::string, std::string> how;
  bool is_survived = false;  ///< the system asks to be asked again
  const char* not_by = "";   ///< but this command's library does not
  [[nodiscard]] bool is_kill() const { return how.contains("FAULT_SIGNAL"); }
};

std::vector<IoFault> io_faults() {
  const auto error = [](int number) {
    return std::map<std::string, std::string>{{"FAULT_ERRNO", std::to_string(number)}};
  };
  const std::map<std::string, std::string> killed{{"FAULT_SIGNAL", std::to_string(SIGKILL)}};
  const std::map<std::string, std::string> killed_before{{"FAULT_SIGNAL", std::to_string(SIGKILL)},
                                                         {"FAULT_EARLY", "1"}};
  return {{"write: killed after", "write", killed},
          {"write: killed before", "write", killed_before},
          {"pwrite: killed after", "pwrite", killed},
          {"pwrite: killed before", "pwrite", killed_before},
          {"fsync: killed after", "fsync", killed},
          {"fsync: killed before", "fsync", killed_before},
          {"rename: killed after", "rename", killed},
          {"rename: killed before", "rename", killed_before},
          {"open: killed after", "open", killed},
          {"open: killed before", "open", killed_before},
          {"write: disk full", "write", error(ENOSPC)},
          {"write: I/O error", "write", error(EIO)},
          {"write: interrupted", "write", error(EINTR), true},
          {"write: half of it", "write", {{"FAULT_SHORT", "1"}}, true},
          {"pwrite: disk full", "pwrite", error(ENOSPC)},
          {"pwrite: I/O error", "pwrite", error(EIO)},
          {"pwrite: interrupted", "pwrite", error(EINTR), true},
          {"pwrite: half of it", "pwrite", {{"FAULT_SHORT", "1"}}, true},
          {"fsync: disk full", "fsync", error(ENOSPC)},
          {"fsync: I/O error", "fsync", error(EIO)},
          {"fsync: interrupted", "fsync", error(EINTR), true, "track ingest"},
          {"rename: disk full", "rename", error(ENOSPC)},
          {"rename: I/O error", "rename", error(EIO)},
          {"rename: interrupted", "rename", error(EINTR), true},
          {"open: disk full", "open", error(ENOSPC)},
          {"open: I/O error", "open", error(EIO)},
          {"open: interrupted", "open", error(EINTR), true},
          {"open: too many files", "open", error(EMFILE)},
          {"mmap: no memory", "mmap", error(ENOMEM)}};
}

/// A command that writes below a folder "out...", and what it leaves there as text: no times, which no two runs share.
struct WritingCommand {
  const char* id;
  std::function<std::vector<std::string>(const std::string& out)> arguments;
  std::function<std::string(const fs::path& out)> content;
  int faults_every = 1;  ///< of how many calls alike one fails
  int kills_every = 1;
};

/// Names and bytes of all files.
std::string files_in(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder)] = file_text(entry.path());
  std::string all;
  for (const auto& [name, text] : files) all += fmt::format("{} {}\n{}\n", name, text.size(), text);
  return all;
}

/// Each case once, with its status and its number of samples.
std::string cases_in(const fs::path& folder) {
  std::string all;
  const reliefbench::Run run = load_run(folder);
  std::map<std::string, std::string> cases;
  for (const Record& record : run.records) {
    const auto samples = std::ranges::count(run.samples, record.case_id,
                                            [](const Sample& one) -> const std::string& { return one.case_id; });
    cases[record.case_id] += fmt::format("{} {} {}", status_id(record.status), record.reason, samples);
  }
  for (const auto& [id, what] : cases) all += fmt::format("{} {}\n", id, what);
  const std::string lines = file_text(folder / kResultsFile);
  return all + fmt::format("{} lines\n", std::ranges::count(lines, '\n'));
}

/// And the names of all files.
std::string run_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) names.push_back(fs::relative(entry, folder));
  std::ranges::sort(names);
  return cases_in(folder) + fmt::format("{}", fmt::join(names, "\n"));
}

class IoFaultTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "config.json") << small_config();
    ASSERT_EQ(run_reliefbench({"sweep", "config.json", "-o", "run", "--backend", "null", "--quiet"}, folder_.path())
                  .exit_code,
              0);
  }
  /// What the command leaves in a new folder.
  [[nodiscard]] std::string left_by(const WritingCommand& command, const CommandServer& server) const {
    fs::create_directories(folder_ / kOut);
    EXPECT_EQ(server.run().exit_code, 0) << command.id;
    std::string content = command.content(folder_ / kOut);
    fs::remove_all(folder_ / kOut);
    return content;
  }
  /// Fails the n-th matching call of the command; whether there was one.
  bool fails(const WritingCommand& command, const CommandServer& server, const IoFault& fault, int at,
             const std::string& undisturbed) const {
    const fs::path folder = folder_ / kOut;
    fs::create_directories(folder);
    std::map<std::string, std::string> environment = fault.how;
    environment["FAULT_CALL"] = fault.call;
    environment["FAULT_AT"] = std::to_string(at);
    environment["FAULT_FILE"] = std::string(kOut) + "/";
    environment["FAULT_MARK"] = folder_ / "mark";
    const CommandResult result = server.run(environment);
    const bool is_done = result.exit_code == static_cast<int>(Exit::done);
    const std::string where = fmt::format("{}, {} at {}: {}", command.id, fault.id, at, result.err);
    EXPECT_TRUE(is_done || !fault.is_survived || std::string_view(fault.not_by) == command.id) << where;
    if (result.signal != 0) {
      EXPECT_TRUE(fault.is_kill() && result.signal == SIGKILL) << "signal " << result.signal << ", " << where;
    } else if (!is_done) {
      EXPECT_EQ(result.exit_code, static_cast<int>(Exit::environment)) << where;
      EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << where;
      EXPECT_NE(result.err.find(std::string(kOut) + "/"), std::string::npos) << where;
    }
    if (!is_done) {
      const CommandResult again = server.run();
      EXPECT_EQ(again.exit_code, 0) << where << again.err;
    }
    EXPECT_EQ(command.content(folder), undisturbed) << where;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      EXPECT_FALSE(is_temporary_name(entry.path().filename().string())) << entry.path() << " " << where;
    fs::remove_all(folder);
    return fs::remove(folder_ / "mark");
  }
  static constexpr const char* kOut = "out";
  TempFolder folder_{memory_path()};
};

TEST_F(IoFaultTest, at_any_call_of_any_command_loses_nothing) {
  const auto of_file = [](const char* name) {
    return [name](const fs::path& out) { return file_text(out / name) + files_in(out).substr(0, 40); };
  };
  const std::vector<WritingCommand> commands = {
      {"sweep",
       [](const std::string& out) {
         return std::vector<std::string>{"sweep", "config.json", "-o", out + "/run", "--backend", "null", "--quiet"};
       },
       [](const fs::path& out) { return run_in(out / "run"); }},
      {"tune",
       [](const std::string& out) {
         return std::vector<std::string>{"tune", "config.json", "-o", out + "/run", "--backend", "null", "--quiet"};
       },
       [](const fs::path& out) { return nlohmann::json::parse(file_text(out / "run/tune.json")).at("space").dump(); },
       is_thorough() ? 1 : 7, is_thorough() ? 1 : 3},
      {"bake",
       [](const std::string& out) {
         return std::vector<std::string>{"bake", "fbm", "--size", "16x16", "--map", "quick", "-o", out + "/map.ktx2"};
       },
       of_file("map.ktx2")},
      {"presets",
       [](const std::string& out) {
         return std::vector<std::string>{"presets", "run", "-o", out + "/presets.json"};
       },
       of_file("presets.json")},
      {"report",
       [](const std::string& out) {
         return std::vector<std::string>{"report", "run", "-o", out + "/page.html"};
       },
       of_file("page.html")},
      {"export",
       [](const std::string& out) {
         return std::vector<std::string>{"export", "fbm",     "--size", "16x16",
                                         "--case", "max_mip", "-o",     out + "/shipped"};
       },
       [](const fs::path& out) { return files_in(out / "shipped"); }},
      {"track ingest",
       [](const std::string& out) {
         return std::vector<std::string>{"track", "ingest", "run", "--db", out + "/history.db"};
       },
       [](const fs::path& out) { return content_of((out / "history.db").string()); }},
  };
  std::map<std::string, std::map<std::string, int>> table;
  int faults = 0;
  int kills = 0;
  for (const WritingCommand& command : commands) {
    // Workers would count calls of their own.
    const CommandServer server(command.arguments(kOut), folder_.path(), {.environment = {{kInProcess, "1"}}});
    const std::string undisturbed = left_by(command, server);
    for (const IoFault& fault : io_faults())
      for (int at = 1; fails(command, server, fault, at, undisturbed);
           at += (kIsSanitized ? 80 : 1) * (fault.is_kill() ? command.kills_every : command.faults_every)) {
        ++table[fault.id][command.id];
        ++(fault.is_kill() ? kills : faults);
        if (HasFailure()) return;
      }
  }
  fmt::print("{:<22}", "fault");
  for (const WritingCommand& command : commands) fmt::print("{:>14}", command.id);
  for (auto& [id, row] : table) {
    fmt::print("\n{:<22}", id);
    for (const WritingCommand& command : commands) fmt::print("{:>14}", row[command.id]);
  }
  fmt::print("\n{} faults and {} kills in all\n", faults, kills);
  EXPECT_GE(faults, tried(1000, 5000, 30));
  EXPECT_GE(kills, tried(1000, 4000, 30));
  EXPECT_GE(faults + kills, tried(2000, 10'000, 60));
}

// What is too large for messages goes between host and worker through memory that both map. Where one of them cannot,
// the command says so; given again, it has all. (A sweep's own arguments must not hold "worker".)
TEST_F(IoFaultTest, memory_that_cannot_be_shared_loses_nothing) {
  if (find_backend("opengl").devices().empty()) GTEST_SKIP() << "no device of opengl";
  const auto sweep = [&](const std::string& out, const std::map<std::string, std::string>& fault) {
    return run_reliefbench({"sweep", "config.json", "-o", out, "--backend", "opengl", "--quiet"}, folder_.path(),
                           {.environment = fault});
  };
  for (const auto& [process, out] : {std::pair("sweep", "of_host"), std::pair("worker", "of_other")}) {
    const CommandResult result = sweep(out, {{"LD_PRELOAD", RELIEFBENCH_FAULTS},
                                             {"FAULT_CALL", "mmap"},
                                             {"FAULT_AT", "0"},
                                             {"FAULT_ERRNO", std::to_string(ENOMEM)},
                                             {"FAULT_FILE", "memfd:reliefbench"},
                                             {"FAULT_PROCESS", process}});
    EXPECT_EQ(result.exit_code, static_cast<int>(Exit::environment)) << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_NE(result.err.find("shared memory cannot be mapped"), std::string::npos) << result.err;
    ASSERT_EQ(sweep(out, {}).exit_code, 0);
    for (const Record& record : load_run(folder_ / out).records) EXPECT_EQ(record.status, Status::ok);
  }
  EXPECT_EQ(cases_in(folder_ / "of_host"), cases_in(folder_ / "of_other"));
}

}  // namespace
}  // namespace reliefbench
