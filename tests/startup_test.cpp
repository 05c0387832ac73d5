// What the binary costs before it does anything.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "tests/command.h"
#include "tests/image_files.h"
#include "tests/temp_folder.h"
#include "tests/thorough.h"

namespace reliefbench {
namespace {

/// CPU time of all ended children, in ms: what others do on the machine does not count.
double children_ms() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto ms = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_usec) * 1e-3;
  };
  return ms(usage.ru_utime) + ms(usage.ru_stime);
}

TEST(StartUp, help_takes_under_50_ms) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer starts slowly";
  const TempFolder folder;
  std::vector<double> times_ms;
  for (int i = 0; i < 11; ++i) {  // the first one warms up
    const double before_ms = children_ms();
    ASSERT_EQ(run_reliefbench({"--help"}, folder.path()).exit_code, 0);
    times_ms.push_back(children_ms() - before_ms);
  }
  // Beside other work, even a process's own time grows.
  EXPECT_LT(*std::min_element(times_ms.begin() + 1, times_ms.end()), 50) << "ms of CPU time, least of ten";
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
