// Commands that are asked to stop: they end with what they have, unless nobody asked them.
#include "kernels/base/stop_signals.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/temp_folder.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

class StopSignals : public ::testing::Test {
 protected:
  TempFolder folder_;
};

/// A command that draws into the folder's output. ignored: a signal that it is started without; 0: none
pid_t start_drawing(std::vector<std::string> command, const std::filesystem::path& folder, const std::string& output,
                    int ignored = 0) {
  command.insert(command.end(), {"-o", output, "--backend", "null", "--json", "--quiet"});
  const pid_t child = start_reliefbench(command, folder, {.before_start = [ignored] {
                                          for (const int signal : kStopSignals)
                                            std::signal(signal, signal == ignored ? SIG_IGN : SIG_DFL);
                                        }});
  while (!std::filesystem::exists(folder / output / kImagesFolder))
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  return child;
}

/// What a command of the folder ends with that gets the signal while it draws.
CommandResult interrupted(const std::vector<std::string>& command, const std::filesystem::path& folder,
                          const std::string& output, int signal) {
  const pid_t child = start_drawing(command, folder, output);
  kill(child, signal);
  return wait_for(child, folder);
}

constexpr std::string_view kLongSearch = R"({
    "scenes": [{"heightmap": {"source": "fbm", "width": 64, "height": 64}, "views": "oblique", "frame_px": [256, 256]}],
    "measure": {"batch_ms": 0.01, "warmup_batches_max": 1},
    "sweeps": [{"technique": "relief", "axes": {"linear_steps": {"from": 4, "to": 512, "step": 1}}}]})";

TEST_F(StopSignals, sigterm_ends_tune_with_the_answer_so_far) {
  std::ofstream(folder_ / "large.json") << kLongSearch;
  for (const int signal : kStopSignals) {
    const std::string output = "tune" + std::to_string(signal);
    const CommandResult result = interrupted({"tune", "large.json"}, folder_.path(), output, signal);
    EXPECT_EQ(result.exit_code, static_cast<int>(Exit::inconclusive)) << "signal " << result.signal << result.err;
    EXPECT_TRUE(nlohmann::json::parse(result.out).at("certificate").at("stopped"));
    EXPECT_TRUE(std::filesystem::exists(folder_ / output / "tune.json"));
  }
}

TEST_F(StopSignals, under_nohup_tune_outlives_its_terminal) {
  std::ofstream(folder_ / "large.json") << kLongSearch;
  const pid_t child = start_drawing({"tune", "large.json"}, folder_.path(), "tune", SIGHUP);
  kill(child, SIGHUP);
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, WNOHANG), 0) << file_text(folder_ / "stderr.txt");
  kill(child, SIGTERM);
  EXPECT_EQ(wait_for(child, folder_.path()).exit_code, static_cast<int>(Exit::inconclusive));
}

TEST_F(StopSignals, sigterm_ends_stress_with_what_was_drawn) {
  for (const int signal : kStopSignals) {
    const std::string output = "stress" + std::to_string(signal);
    const CommandResult result = interrupted({"stress", "--random", "2000", "--filter", "flat/*"}, folder_.path(),
                                             output, signal);  // none fails
    EXPECT_EQ(result.exit_code, static_cast<int>(Exit::inconclusive)) << "signal " << result.signal << result.err;
    EXPECT_GT(nlohmann::json::parse(result.out).at("undone"), 0);
    EXPECT_TRUE(std::filesystem::exists(folder_ / output / "stress.html"));
  }
}

// It writes no folder: it is drawing once its progress is told.
TEST_F(StopSignals, sigterm_ends_claims_with_the_answer_so_far) {
  const pid_t child = start_reliefbench({"claims", "--filter", "engines", "--backend", "null", "--json"},
                                        folder_.path(), {.before_start = [] {
                                          for (const int signal : kStopSignals) std::signal(signal, SIG_DFL);
                                        }});
  while (file_text(folder_ / "stderr.txt").empty()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  kill(child, SIGTERM);
  const CommandResult result = wait_for(child, folder_.path());
  EXPECT_EQ(result.exit_code, static_cast<int>(Exit::inconclusive)) << "signal " << result.signal << result.err;
  EXPECT_GT(nlohmann::json::parse(result.out).back().at("undone"), 0);
}

}  // namespace
}  // namespace reliefbench
