#include "kernels/base/pending_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(PendingFolder, is_there_as_a_whole_or_not_at_all) {
  const TempFolder folder;
  const auto count = [&] { return std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()); };
  { const PendingFolder left(folder / "out"); }
  EXPECT_EQ(count(), 0);
  const pid_t child = fork();
  if (child == 0) {
    const PendingFolder killed(folder / "out");
    std::ofstream(killed.path() / "half") << "half";
    raise(SIGKILL);
  }
  waitpid(child, nullptr, 0);
  EXPECT_EQ(count(), 1);
  PendingFolder one(folder / "out/");
  EXPECT_EQ(count(), 1) << "what the killed one left is gone";
  const PendingFolder two(folder / "other");
  EXPECT_EQ(count(), 2) << "and the living one's not";
  std::ofstream(one.path() / "file") << "whole";
  fs::create_directory(folder / "out");
  one.commit();
  EXPECT_EQ(file_text(folder / "out/file"), "whole");
  EXPECT_THAT([&] { PendingFolder(folder / "out"); }, ThrowsMessage<Error>(HasSubstr("is not empty")));
}

}  // namespace
}  // namespace reliefbench
