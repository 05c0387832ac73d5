#include "kernels/base/append_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

std::string errno_text(int number) { return std::generic_category().message(number); }

}  // namespace

AppendFile::AppendFile(std::filesystem::path path) : path_(std::move(path)) {
  const auto give_up = [&](std::string_view why) {
    if (fd_ >= 0) ::close(fd_);
    fail_input("{}: {}", path_.string(), why);
  };
  fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (fd_ < 0) give_up("cannot be written: " + errno_text(errno));
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) give_up("another process is writing to it");
  const std::string text = read_file(path_);
  const std::size_t whole = text.rfind('\n') + 1;  // npos + 1 = 0: no line at all
  if (whole != text.size() && ::ftruncate(fd_, static_cast<off_t>(whole)) != 0)
    give_up("its torn last line cannot be cut off: " + errno_text(errno));
}

AppendFile::~AppendFile() { ::close(fd_); }

void AppendFile::append(std::string_view line) {
  std::string bytes(line);
  bytes += '\n';
  struct stat before {};
  if (::fstat(fd_, &before) != 0) fail_environment("{}: {}", path_.string(), errno_text(errno));
  ssize_t written = 0;
  do written = ::write(fd_, bytes.data(), bytes.size());
  while (written < 0 && errno == EINTR);
  if (written == static_cast<ssize_t>(bytes.size())) return;
  const std::string why = written < 0 ? errno_text(errno) : "the disk is full";
  // Half a line must not stand in front of later ones.
  const bool restored = ::ftruncate(fd_, before.st_size) == 0;
  fail_environment("{}: cannot be written{}: {}", path_.string(), restored ? "" : " and holds a torn line", why);
}

std::string read_file(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) fail_input("{}: is a folder, expected a file", path.string());
  std::ifstream file(path, std::ios::binary);
  if (!file) fail_input("{}: cannot be read: {}", path.string(), errno_text(errno));
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (file.bad()) fail_input("{}: reading stopped half-way", path.string());
  return text;
}

}  // namespace reliefbench
