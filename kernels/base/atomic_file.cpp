#include "kernels/base/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <ostream>
#include <random>
#include <streambuf>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "kernels/base/file_error.h"
#include "kernels/base/uninterrupted.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

// A temporary file is <prefix><16 hexadecimal digits><suffix>, whatever it will be called.
constexpr std::string_view kPrefix = ".reliefbench-";
constexpr std::string_view kSuffix = ".tmp";
constexpr std::size_t kDigits = 16;

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

/// Removes a temporary file unless its writer, who holds its lock, still lives.
void remove_if_stale(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return;
  if (::flock(fd, LOCK_EX | LOCK_NB) == 0) ::unlink(path.c_str());
  ::close(fd);
}

/// What goes to a descriptor, some of it at a time.
class FileBuffer final : public std::streambuf {
 public:
  FileBuffer(int fd, const fs::path& path) : fd_(fd), path_(path), held_(std::size_t{1} << 16U) { reset(); }

 private:
  int_type overflow(int_type c) override {
    sync();
    if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
  }
  std::streamsize xsputn(const char* bytes, std::streamsize count) override {
    if (count > epptr() - pptr()) {
      sync();
      write({bytes, static_cast<std::size_t>(count)});
    } else {
      std::copy_n(bytes, count, pptr());
      pbump(static_cast<int>(count));
    }
    return count;
  }
  int sync() override {
    const std::string_view bytes(pbase(), static_cast<std::size_t>(pptr() - pbase()));
    reset();
    write(bytes);
    return 0;
  }
  void reset() { setp(held_.data(), held_.data() + held_.size()); }
  void write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = uninterrupted([&] { return ::write(fd_, bytes.data(), bytes.size()); });
      if (written <= 0) fail_file(path_, "cannot be written", written < 0 ? errno : ENOSPC);
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
  }

  int fd_;
  const fs::path& path_;
  std::vector<char> held_;
};

}  // namespace

std::string temporary_name() {
  std::random_device random;
  return fmt::format("{}{:08x}{:08x}{}", kPrefix, random(), random(), kSuffix);
}

bool is_temporary_name(std::string_view name) {
  return name.size() == kPrefix.size() + kDigits + kSuffix.size() && name.starts_with(kPrefix) &&
         name.ends_with(kSuffix) &&
         name.substr(kPrefix.size(), kDigits).find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

PendingFile::PendingFile(fs::path path, std::string_view bytes)
    : PendingFile(std::move(path),
                  [bytes](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); }) {
}

PendingFile::PendingFile(fs::path path, const WriteBytes& write) : path_(std::move(path)) {
  try {
    open();
    FileBuffer buffer(fd_, path_);
    std::ostream out(&buffer);
    out.exceptions(std::ios::badbit);  // or it would keep what the buffer throws to itself
    write(out);
    out.flush();
    if (uninterrupted([&] { return ::fsync(fd_); }) != 0) fail_file(path_, "cannot be written", errno);
  } catch (...) {
    discard();
    throw;
  }
}

PendingFile::~PendingFile() { discard(); }

PendingFile::PendingFile(PendingFile&& other) noexcept
    : path_(std::move(other.path_)), temporary_(std::move(other.temporary_)), fd_(std::exchange(other.fd_, -1)) {}

void PendingFile::open() {
  for (;;) {
    temporary_ = folder_of(path_) / temporary_name();
    fd_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (fd_ < 0 && (errno == EEXIST || errno == EINTR)) continue;
    if (fd_ < 0) fail_file(path_, "cannot be written", errno);
    // Between the two calls another process may take the unlocked file for a stale one and remove it.
    const bool is_taken = ::flock(fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    struct stat status {};
    if (!is_taken && ::fstat(fd_, &status) == 0 && status.st_nlink > 0) return;
    ::close(std::exchange(fd_, -1));
  }
}

void PendingFile::discard() {
  if (fd_ < 0) return;
  ::unlink(temporary_.c_str());
  ::close(std::exchange(fd_, -1));
}

void PendingFile::commit() {
  if (uninterrupted([&] { return ::rename(temporary_.c_str(), path_.c_str()); }) != 0)
    fail_file(path_, "cannot be written", errno);
  ::close(std::exchange(fd_, -1));
  // The rename itself lasts only once the folder is on disk; file systems that cannot sync a folder need no such call.
  const int folder = ::open(folder_of(path_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  ::fsync(folder);
  ::close(folder);
}

void write_atomically(const fs::path& path, std::string_view bytes) { PendingFile(path, bytes).commit(); }
void write_atomically(const fs::path& path, const WriteBytes& write) { PendingFile(path, write).commit(); }

void write_output(const fs::path& path, std::string_view bytes) {
  remove_stale_temporaries(folder_of(path));
  write_atomically(path, bytes);
}

void remove_stale_temporaries(const fs::path& folder) {
  std::error_code unreadable;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, unreadable))
    if (is_temporary_name(entry.path().filename().string())) remove_if_stale(entry.path());
}

}  // namespace reliefbench
