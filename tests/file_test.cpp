// Files and the console: what is written is whole, follows no link and leaves nothing behind; what is printed is a
// line.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>

#include <fstream>

#include "kernels/base/append_file.h"
#include "kernels/base/atomic_file.h"
#include "kernels/base/console.h"
#include "kernels/base/file_error.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class FileTest : public ::testing::Test {
 protected:
  void write(const std::string& name, std::string_view text) const { std::ofstream(folder_ / name) << text; }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& entry : fs::directory_iterator(folder_.path())) all.push_back(entry.path().filename());
    std::ranges::sort(all);
    return all;
  }
  TempFolder folder_;
};

TEST_F(FileTest, a_link_is_replaced_and_not_followed) {
  write("mine", "mine");
  fs::create_symlink(folder_ / "mine", folder_ / "out");
  write_atomically(folder_ / "out", "new");
  EXPECT_EQ(read_file(folder_ / "mine"), "mine");
  EXPECT_EQ(read_file(folder_ / "out"), "new");
  EXPECT_EQ(names(), (std::vector<std::string>{"mine", "out"}));
}

TEST_F(FileTest, temporary_names_differ_every_time) {
  const PendingFile one(folder_ / "out", "1");
  const PendingFile two(folder_ / "out", "2");
  EXPECT_EQ(names().size(), 2U);
  for (const std::string& name : names()) EXPECT_EQ(name.size(), names().front().size());
}

TEST_F(FileTest, what_is_not_committed_goes) {
  { const PendingFile pending(folder_ / "out", "1"); }
  EXPECT_TRUE(names().empty());
}

TEST_F(FileTest, what_is_streamed_is_whole_or_not_there) {
  std::string whole;
  write_atomically(folder_ / "out", [&](std::ostream& out) {
    for (std::size_t length = 1; length < 200000; length *= 3) {  // within the buffer, and beyond it
      const std::string piece(length, static_cast<char>('a' + length % 26));
      out << piece << '\n' << length;
      whole += piece + '\n' + std::to_string(length);
    }
  });
  EXPECT_EQ(read_file(folder_ / "out"), whole);
  const WriteBytes half = [](std::ostream& out) {
    out << std::string(100000, 'x');
    fail_file("elsewhere", "is gone", EIO);
  };
  EXPECT_THROW(write_atomically(folder_ / "out", half), FileError);
  EXPECT_EQ(read_file(folder_ / "out"), whole);
  EXPECT_EQ(names(), (std::vector<std::string>{"out"}));
}

TEST_F(FileTest, what_killed_writers_left_goes_and_nothing_else) {
  const pid_t child = fork();
  if (child == 0) {
    const PendingFile pending(folder_ / "out", "torn");
    raise(SIGKILL);
  }
  waitpid(child, nullptr, 0);
  ASSERT_EQ(names().size(), 1U);
  const std::string stale = names().front();
  const PendingFile living(folder_ / "out", "1");
  write("mine.tmp", "");
  write(".reliefbench-0123456789abcdeX.tmp", "");
  fs::create_directory(folder_ / ".reliefbench-0123456789abcdef.tmp");
  remove_stale_temporaries(folder_.path());
  EXPECT_FALSE(fs::exists(folder_ / stale));
  EXPECT_EQ(names().size(), 4U) << "the living one, and three that are not ours";
}

TEST_F(FileTest, a_full_disk_is_the_environments_and_a_missing_folder_the_users) {
  const auto code_of = [](const std::function<void()>& write) {
    try {
      write();
    } catch (const FileError& error) {
      return error.code();
    }
    return Exit::done;
  };
  EXPECT_EQ(code_of([] { fail_file("x", "cannot be written", ENOSPC); }), Exit::environment);
  EXPECT_EQ(code_of([] { fail_file("x", "cannot be written", EIO); }), Exit::environment);
  EXPECT_EQ(code_of([] { fail_file("x", "cannot be written", EMFILE); }), Exit::environment);
  EXPECT_EQ(code_of([&] { write_atomically(folder_ / "none/x", "1"); }), Exit::bad_input);
  EXPECT_EQ(code_of([&] { (void)read_file(folder_ / "none"); }), Exit::bad_input);
}

TEST_F(FileTest, reading_ends) {
  EXPECT_THAT([] { (void)read_file("/dev/zero"); }, ThrowsMessage<Error>(HasSubstr("/dev/zero: is a device")));
  EXPECT_THAT([&] { (void)read_file(folder_.path()); }, ThrowsMessage<Error>(HasSubstr("is a folder")));
}

TEST_F(FileTest, appending_follows_no_link_and_removes_only_its_own) {
  write("mine", "mine\n");
  fs::create_symlink(folder_ / "mine", folder_ / "link");
  EXPECT_THAT([&] { AppendFile(folder_ / "link"); }, ThrowsMessage<Error>(HasSubstr("is a symbolic link")));
  AppendFile(folder_ / "mine").remove_if_made();
  EXPECT_TRUE(fs::exists(folder_ / "mine"));
  AppendFile(folder_ / "new").remove_if_made();
  EXPECT_FALSE(fs::exists(folder_ / "new"));
}

// One who waits for the lock of a file that its holder removes must not write to a file without a name.
TEST_F(FileTest, a_removed_file_is_made_again) {
  AppendFile first(folder_ / "x");
  EXPECT_THAT([&] { AppendFile(folder_ / "x"); }, ThrowsMessage<Error>(HasSubstr("another process")));
  first.remove_if_made();
  AppendFile second(folder_ / "x");
  second.append("line");
  EXPECT_EQ(read_file(folder_ / "x"), "line\n");
}

TEST(Console, a_message_is_one_line) {
  EXPECT_EQ(one_line("a\nb\r\tc"), "a\\nb\\x0d\\x09c");
  EXPECT_EQ(one_line("\x1b[31mred\x7f"), "\\x1b[31mred\\x7f");
  EXPECT_EQ(one_line("Höhe → µm 😀"), "Höhe → µm 😀");
  EXPECT_EQ(one_line("\xff\xc3("), "\\xff\\xc3(");
  EXPECT_EQ(one_line("csi \xc2\x9b, \xe2\x80\xae turned"), "csi \\xc2\\x9b, \\xe2\\x80\\xae turned");
  EXPECT_EQ(one_line("\xe0\x80\x8a"), "\\xe0\\x80\\x8a") << "an overlong newline";
}

TEST(Console, a_long_message_keeps_its_ends) {
  const std::string text = "begin" + std::string(100'000, 'x') + "end";
  const std::string line = one_line(text);
  EXPECT_LT(line.size(), kLongestLine + 100);
  EXPECT_THAT(line, ::testing::StartsWith("begin"));
  EXPECT_THAT(line, ::testing::EndsWith("end"));
  EXPECT_THAT(line, HasSubstr("99008 bytes left out"));
}

}  // namespace
}  // namespace reliefbench
