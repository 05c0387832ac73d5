#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/command.h"
#include "tests/temp_folder.h"

namespace reliefbench {

inline const std::string kSmoke = std::string(RELIEFBENCH_SOURCE_DIR) + "/configs/smoke.json";

class CliTest : public ::testing::Test {
 protected:
  [[nodiscard]] CommandResult run(const std::vector<std::string>& arguments) const {
    return run_reliefbench(arguments, folder_.path());
  }
  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  [[nodiscard]] std::string config_on(const std::string& heightmap) const {
    const std::string name = "config.json";
    write(name,
          R"({"scenes": [{"heightmap": ")" + heightmap + R"(", "views": "top"}], "sweeps": [{"technique": "flat"}]})");
    return name;
  }
  /// One line on stderr with these words, this exit code, and no output folder.
  void expect_refused(const std::vector<std::string>& arguments, int exit_code, const std::string& words) const {
    const CommandResult result = run(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_THAT(result.err, testing::HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
  }

  TempFolder folder_;
};

/// On real devices, whose timers are audited as a sweep starts.
class CliDeviceAudit : public CliTest {};

/// A run's line file with one text replaced in its first line.
inline void spoil(const std::filesystem::path& file, const std::string& before, const std::string& after) {
  std::string text = file_text(file);
  const std::size_t at = text.find(before);
  ASSERT_NE(at, std::string::npos) << before;
  std::ofstream(file) << text.replace(at, before.size(), after);
}

}  // namespace reliefbench
