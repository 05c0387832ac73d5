#include "kernels/base/append_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <utility>

#include "kernels/base/file_error.h"
#include "kernels/base/uninterrupted.h"

namespace reliefbench {
namespace {

/// Whether the path still leads to the open file: the one who held the lock before may have removed it.
bool leads_to(const std::filesystem::path& path, int fd) {
  struct stat open_file {};
  struct stat named {};
  return ::fstat(fd, &open_file) == 0 && ::lstat(path.c_str(), &named) == 0 && open_file.st_dev == named.st_dev &&
         open_file.st_ino == named.st_ino;
}

/// Gives a file's bytes, chunk by chunk. throws: as read_file(), and what `take` throws
void read_chunks(const std::filesystem::path& path, const std::function<void(std::string_view)>& take) {
  const int fd = uninterrupted([&] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC); });
  if (fd < 0) fail_file(path, "cannot be read", errno);
  const std::unique_ptr<const int, void (*)(const int*)> closes(&fd, [](const int* one) { ::close(*one); });
  struct stat status {};
  if (::fstat(fd, &status) != 0) fail_file(path, "cannot be read", errno);
  if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode))  // devices may never end
    fail_input("{}: is a {}, expected a file", path.string(), S_ISDIR(status.st_mode) ? "folder" : "device");
  std::array<char, 1 << 16> chunk{};
  for (ssize_t count = 1; count != 0;) {
    count = uninterrupted([&] { return ::read(fd, chunk.data(), chunk.size()); });
    if (count > 0) take(std::string_view(chunk.data(), static_cast<std::size_t>(count)));
    if (count < 0) fail_file(path, "cannot be read", errno);
  }
}

}  // namespace

AppendFile::AppendFile(std::filesystem::path path) : path_(std::move(path)) {
  try {
    do open();
    while (!leads_to(path_, fd_));
  } catch (...) {
    if (fd_ >= 0) ::close(fd_);
    throw;
  }
}

void AppendFile::open() {
  if (fd_ >= 0) ::close(fd_);
  constexpr int kFlags = O_RDWR | O_APPEND | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  fd_ = uninterrupted([&] { return ::open(path_.c_str(), kFlags | O_CREAT | O_EXCL, 0666); });
  is_made_ = fd_ >= 0;
  if (!is_made_ && errno == EEXIST) fd_ = uninterrupted([&] { return ::open(path_.c_str(), kFlags); });
  if (fd_ < 0 && errno == ELOOP) fail_input("{}: is a symbolic link", path_.string());
  if (fd_ < 0) fail_file(path_, "cannot be written", errno);
  if (::flock(fd_, LOCK_EX | LOCK_NB) == 0) return;
  if (errno == EWOULDBLOCK) fail_input("{}: another process is writing to it", path_.string());
  fail_file(path_, "cannot be locked", errno);
}

AppendFile::~AppendFile() { ::close(fd_); }

bool AppendFile::is_empty() const {
  struct stat status {};
  return ::fstat(fd_, &status) == 0 && status.st_size == 0;
}

void AppendFile::cut_torn_line() {
  const std::string text = read_file(path_);
  const std::size_t whole = text.rfind('\n') + 1;  // npos + 1 = 0: no line at all
  if (whole != text.size() && ::ftruncate(fd_, static_cast<off_t>(whole)) != 0)
    fail_file(path_, "its torn last line cannot be cut off", errno);
}

void AppendFile::append(std::string_view line) {
  const std::string bytes = std::string(line) + '\n';
  struct stat before {};
  if (::fstat(fd_, &before) != 0) fail_file(path_, "cannot be written", errno);
  for (std::string_view rest = bytes; !rest.empty();) {
    const ssize_t written = uninterrupted([&] { return ::write(fd_, rest.data(), rest.size()); });
    if (written > 0) {
      rest.remove_prefix(static_cast<std::size_t>(written));
      continue;
    }
    const int why = written < 0 ? errno : ENOSPC;
    // Half a line must not stand in front of later ones.
    const bool is_restored = ::ftruncate(fd_, before.st_size) == 0;
    fail_file(path_, is_restored ? "cannot be written" : "cannot be written and holds a torn line", why);
  }
}

void AppendFile::remove_if_made() {
  if (is_made_) ::unlink(path_.c_str());
}

std::string read_file(const std::filesystem::path& path) {
  std::string text;
  read_chunks(path, [&](std::string_view chunk) { text.append(chunk); });
  return text;
}

void read_lines(const std::filesystem::path& path, std::size_t most_bytes,
                const std::function<void(std::string_view)>& take) {
  std::string begun;  // of a line that goes on in the next chunk
  read_chunks(path, [&](std::string_view chunk) {
    for (std::size_t end = 0; (end = chunk.find('\n')) != std::string_view::npos; chunk.remove_prefix(end + 1)) {
      begun.append(chunk.substr(0, end));
      take(begun);
      begun.clear();
    }
    if (begun.size() <= most_bytes) begun.append(chunk);
  });
}

}  // namespace reliefbench
