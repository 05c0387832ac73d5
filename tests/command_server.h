#pragma once
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/command.h"

namespace reliefbench {

/// A command that is loaded once and then run many times, each in a fork of that (FAULT_SERVER): the loader's time is
/// most of a short one's.
class CommandServer {
 public:
  CommandServer(const std::vector<std::string>& arguments, std::filesystem::path folder, CommandSetting setting)
      : folder_(std::move(folder)), setting_(std::move(setting)) {
    std::array<int, 2> requests{};
    std::array<int, 2> replies{};
    EXPECT_EQ(pipe2(requests.data(), O_CLOEXEC), 0);
    EXPECT_EQ(pipe2(replies.data(), O_CLOEXEC), 0);
    setting_.environment["LD_PRELOAD"] = RELIEFBENCH_FAULTS;
    setting_.environment["FAULT_SERVER"] = std::to_string(requests[0]) + " " + std::to_string(replies[1]);
    setting_.before_start = [=] {
      for (const int inherited : {requests[0], replies[1]}) fcntl(inherited, F_SETFD, 0);
    };
    server_ = start_reliefbench(arguments, folder_, setting_);
    close(requests[0]);
    close(replies[1]);
    requests_ = requests[1];
    replies_ = replies[0];
  }
  ~CommandServer() {
    close(requests_);  // which ends it
    close(replies_);
    waitpid(server_, nullptr, 0);
  }
  CommandServer(const CommandServer&) = delete;
  CommandServer& operator=(const CommandServer&) = delete;

  /// environment: beside the server's
  [[nodiscard]] CommandResult run(const std::map<std::string, std::string>& environment = {}) const {
    std::string text;
    for (const auto& [name, value] : environment) text.append(name).append("=").append(value).push_back('\0');
    const auto size = static_cast<std::uint32_t>(text.size());
    EXPECT_EQ(write(requests_, &size, sizeof(size)), static_cast<ssize_t>(sizeof(size)));
    EXPECT_EQ(write(requests_, text.data(), size), static_cast<ssize_t>(size));
    int status = 0;
    EXPECT_EQ(read(replies_, &status, sizeof(status)), static_cast<ssize_t>(sizeof(status))) << "the server is gone";
    return result_of(status, folder_, setting_);
  }

 private:
  std::filesystem::path folder_;
  CommandSetting setting_;
  pid_t server_ = 0;
  int requests_ = -1;
  int replies_ = -1;
};

}  // namespace reliefbench
