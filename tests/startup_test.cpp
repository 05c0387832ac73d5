// What the binary costs before it does anything.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string>

#include "tests/image_files.h"
#include "tests/temp_folder.h"
#include "tests/thorough.h"

namespace reliefbench {
namespace {

/// What glibc's loader says when the program runs: its statistics, in lines of "name: number".
long of_loader(const std::string& what) {
  const TempFolder folder;
  const std::string text = (folder / "statistics").string();
  const std::string command = "LD_DEBUG=statistics " + std::string(RELIEFBENCH_BINARY) + " --help >/dev/null 2>" + text;
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::istringstream lines(read_bytes(text));
  for (std::string line; std::getline(lines, line);)
    if (const std::size_t at = line.find(what + ": "); at != std::string::npos)
      return std::stol(line.substr(at + what.size() + 2));
  ADD_FAILURE() << "no \"" << what << "\"";
  return 0;
}

// What makes a start slow is counted, not timed: symbols to be looked up in libraries, 16,507 when this was written.
TEST(StartUp, help_looks_few_symbols_up) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer brings its own symbols";
  const long symbols = of_loader("final number of relocations");
  EXPECT_GT(symbols, 100) << "or they were not counted";
  EXPECT_LT(symbols, 30'000);
}

TEST(StartUp, few_libraries_are_loaded) {
  const TempFolder folder;
  const std::string list = (folder / "libraries").string();
  ASSERT_EQ(std::system(("ldd " + std::string(RELIEFBENCH_BINARY) + " > " + list).c_str()), 0);
  const std::string libraries = read_bytes(list);
  EXPECT_LT(std::count(libraries.begin(), libraries.end(), '\n'), 80) << libraries;
  EXPECT_THAT(libraries, ::testing::HasSubstr("libpng16"));
}

}  // namespace
}  // namespace reliefbench
