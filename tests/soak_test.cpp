// What `./dev soak` says of what it watched.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "tests/command.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kSoakRounds = 6;
constexpr int kSoakLife = 100;  // seconds

/// A process of each command a round, watched every second. mebibytes: of round and second
std::string watched(const std::function<int(int, int)>& mebibytes, int more_open_a_round = 0) {
  std::string lines;
  for (int round = 1; round <= kSoakRounds; ++round)
    for (int second = 0; second < kSoakLife; ++second)
      for (const auto& [id, command] : {std::pair(1, "sweep"), std::pair(2, "view")})
        lines += fmt::format("{}\t{}\t{}\t{}\t{}\t{}\n", round, command, 10 * round + id, kSoakLife * round + second,
                             1024 * mebibytes(round, second), 12 + round * more_open_a_round);
  return lines;
}

struct SoakEnd {
  std::string text;
  int code = 0;
};
SoakEnd soak_end(const std::string& lines) {
  const TempFolder folder;
  std::ofstream(folder / "watch.tsv") << lines;
  const std::string output =
      output_of(fmt::format("awk -F '\t' -v rounds={} -f '{}/tests/soak.awk' '{}'; echo \" code $?\"", kSoakRounds,
                            RELIEFBENCH_SOURCE_DIR, (folder / "watch.tsv").string()));
  return {.text = output, .code = output.back() == '\n' ? output[output.size() - 2] - '0' : -1};
}

TEST(Soak, says_nothing_of_what_stays_as_it_is) {
  const SoakEnd steady = soak_end(watched([](int, int second) { return 100 + second % 3; }));
  EXPECT_THAT(steady.text,
              HasSubstr("sweep      peaks, first / last third        102.0     102.0      12.0      12.0"));
  EXPECT_THAT(steady.text, Not(HasSubstr("grew")));
  EXPECT_EQ(steady.code, 0);
}

TEST(Soak, marks_what_grows_from_round_to_round) {
  const SoakEnd memory = soak_end(watched([](int round, int) { return 100 + 10 * round; }));
  EXPECT_THAT(memory.text, HasSubstr("sweep      peaks, first / last third        115.0     155.0      12.0      12.0  "
                                     "grew"));
  EXPECT_EQ(memory.code, 1);
  const SoakEnd open = soak_end(watched([](int, int) { return 100; }, 1));
  EXPECT_THAT(open.text, HasSubstr("100.0     100.0      13.5      17.5  grew"));
  EXPECT_EQ(open.code, 1);
}

TEST(Soak, marks_a_viewer_that_grows_while_it_shows_the_same) {
  const SoakEnd grows = soak_end(watched([](int, int second) { return 100 + second; }));
  EXPECT_THAT(grows.text, HasSubstr("view       over a minute, quarter 2 / 4     137.0     187.0      12.0      12.0  "
                                    "grew"));
  EXPECT_THAT(grows.text,
              HasSubstr("sweep      over a minute, quarter 2 / 4     137.0     187.0      12.0      12.0\n"));
  EXPECT_EQ(grows.code, 1);
}

TEST(Soak, goes_on_where_it_was_stopped_unless_the_binary_is_another) {
  const TempFolder folder;
  const auto program = [&](const char* name, const char* text) {
    std::ofstream(folder / name) << "#!/bin/sh\n" << text;
    std::filesystem::permissions(folder / name, std::filesystem::perms::owner_all);
  };
  program("reliefbench", "echo $1\n");
  program("xvfb-run", "shift\nexec \"$@\"\n");
  const auto soak = [&](int seconds) {
    return output_of(fmt::format("PATH='{0}':\"$PATH\" '{1}/tests/soak.sh' '{0}/reliefbench' {2} '{0}/soak'",
                                 folder.path().string(), RELIEFBENCH_SOURCE_DIR, seconds));
  };
  EXPECT_THAT(soak(0), Not(HasSubstr("goes on")));
  int rounds = 0;
  int seconds = 0;
  std::ifstream(folder / "soak/done") >> rounds >> seconds;
  ASSERT_EQ(rounds, 1);
  std::ofstream(folder / "soak/watch.tsv") << "1\tsweep\t7\t0\t1024\t5\n2\tsweep\t8\t1\t1024\t55\n";
  EXPECT_THAT(soak(seconds + 2), HasSubstr(fmt::format("goes on after 1 rounds in {} s", seconds)));
  EXPECT_THAT(file_text(folder / "soak/watch.tsv"), Not(HasSubstr("\t55\n")));  // of a round that was cut short
  std::ifstream(folder / "soak/done") >> rounds;
  EXPECT_GT(rounds, 1);
  program("reliefbench", "echo another $1\n");
  EXPECT_THAT(soak(0), HasSubstr("begins anew"));
}

}  // namespace
}  // namespace reliefbench
