#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace reliefbench {

/// Drivers leak and unload before LeakSanitizer looks, so that it can't name them; our own leaks are looked for in the
/// test binary itself (pinned_drivers.cpp). A library of ours may be preloaded before the sanitizer's.
inline constexpr const char* kChildAsanOptions = "detect_odr_violation=0:detect_leaks=0:verify_asan_link_order=0";

/// What a command printed and how it ended.
struct CommandResult {
  int exit_code = -1;  ///< -1: ended by a signal
  int signal = 0;
  std::string out;
  std::string err;
};

inline std::string file_text(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// What a shell's command prints.
inline std::string output_of(const std::string& command) {
  const auto close = [](FILE* pipe) { pclose(pipe); };
  const std::unique_ptr<FILE, decltype(close)> pipe(popen(command.c_str(), "r"), close);
  std::string text;
  std::array<char, 1 << 16> buffer{};
  for (std::size_t n = 0; (n = fread(buffer.data(), 1, buffer.size(), pipe.get())) > 0;) text.append(buffer.data(), n);
  return text;
}

/// What a command finds where it starts.
struct CommandSetting {
  std::map<std::string, std::string> environment{};
  std::string stdout_file = "stdout.txt";
  std::string stderr_file = "stderr.txt";
  std::function<void()> before_start = [] {};  ///< called in the child: resource limits and the like
};

/// Starts the built binary in `folder`; its output goes to stdout.txt and stderr.txt there.
inline pid_t start_reliefbench(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                               const CommandSetting& setting = {}) {
  std::vector<std::string> words = {RELIEFBENCH_BINARY};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    if (chdir(folder.c_str()) != 0) _exit(127);
    setenv("RELIEFBENCH_CACHE", "cache", 1);
    setenv("ASAN_OPTIONS", kChildAsanOptions, 1);
    setenv("RELIEFBENCH_HEIGHTMAPS", "heightmaps", 1);
    for (const auto& [name, value] : setting.environment) setenv(name.c_str(), value.c_str(), 1);
    dup2(open(setting.stdout_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDOUT_FILENO);
    dup2(open(setting.stderr_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDERR_FILENO);
    setting.before_start();
    execv(argv[0], argv.data());
    _exit(127);
  }
  return child;
}

/// status: of waitpid()
inline CommandResult result_of(int status, const std::filesystem::path& folder, const CommandSetting& setting) {
  const auto text = [&](const std::string& name) {
    return name.starts_with('/') ? std::string() : file_text(folder / name);
  };
  return {.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1,
          .signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0,
          .out = text(setting.stdout_file),
          .err = text(setting.stderr_file)};
}

inline CommandResult wait_for(pid_t child, const std::filesystem::path& folder, const CommandSetting& setting = {}) {
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return result_of(status, folder, setting);
}

inline CommandResult run_reliefbench(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                                     const CommandSetting& setting = {}) {
  return wait_for(start_reliefbench(arguments, folder, setting), folder, setting);
}

/// All commands, as `reliefbench --help` names them.
inline std::vector<std::string> command_names(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  bool inside = false;
  std::istringstream help(run_reliefbench({"--help"}, folder).out);
  for (std::string line; std::getline(help, line) && !(inside && line.empty());) {
    if (inside) names.push_back(line.substr(2, line.find(' ', 2) - 2));
    if (line == "Subcommands:") inside = true;
  }
  EXPECT_GE(names.size(), 18U);
  return names;
}

}  // namespace reliefbench
