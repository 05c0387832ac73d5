#include "kernels/base/pending_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "kernels/base/atomic_file.h"
#include "kernels/base/file_error.h"
#include "kernels/base/uninterrupted.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

constexpr int kFolderFlags = O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;

/// "out/" is "out".
fs::path without_slash(const fs::path& path) { return path.has_filename() ? path : path.parent_path(); }

bool is_locked_by_another(int fd) { return ::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK; }

void check_free(const fs::path& place) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(place, error);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status)) fail_input("{}: is no folder; choose another one", place.string());
  if (!fs::is_empty(place, error) || error) fail_input("{}: is not empty; choose another folder", place.string());
}

void remove_stale_folders(const fs::path& parent) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(parent, ignored)) {
    if (!is_temporary_name(entry.path().filename().string())) continue;
    const int fd = ::open(entry.path().c_str(), kFolderFlags);  // of a file: it fails
    if (fd < 0) continue;
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0) fs::remove_all(entry.path(), ignored);
    ::close(fd);
  }
}

/// To the disk. File systems that cannot sync a folder need no such call.
void flush_to_disk(const fs::path& path) {
  const int fd = uninterrupted([&] { return ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC); });
  if (fd < 0) fail_file(path, "cannot be read", errno);
  const int why = uninterrupted([&] { return ::fsync(fd); }) == 0 ? 0 : errno;
  ::close(fd);
  if (why != 0 && why != EINVAL) fail_file(path, "cannot be written", why);
}

}  // namespace

PendingFolder::PendingFolder(const fs::path& place) : place_(without_slash(place)) {
  check_free(place_);
  const fs::path parent = place_.has_parent_path() ? place_.parent_path() : fs::path(".");
  std::error_code error;
  fs::create_directories(parent, error);
  if (error) fail_file(place_, "cannot be made", error.value());
  remove_stale_folders(parent);
  // Between the two calls another process may take the unlocked folder for a stale one and remove it.
  struct stat status {};
  while (fd_ < 0) {
    temporary_ = parent / temporary_name();
    if (::mkdir(temporary_.c_str(), 0777) != 0) {
      if (errno == EEXIST) continue;
      fail_file(place_, "cannot be made", errno);
    }
    fd_ = uninterrupted([&] { return ::open(temporary_.c_str(), kFolderFlags); });
    if (fd_ < 0 && errno != ENOENT) {
      const int why = errno;
      ::rmdir(temporary_.c_str());
      fail_file(place_, "cannot be made", why);
    }
    if (fd_ >= 0 && (is_locked_by_another(fd_) || ::fstat(fd_, &status) != 0 || status.st_nlink == 0))
      ::close(std::exchange(fd_, -1));
  }
}

PendingFolder::~PendingFolder() {
  if (fd_ < 0) return;
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
  ::close(fd_);
}

void PendingFolder::commit() {
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(temporary_)) flush_to_disk(entry.path());
  if (uninterrupted([&] { return ::rename(temporary_.c_str(), place_.c_str()); }) != 0)
    fail_file(place_, "cannot be made", errno);
  ::close(std::exchange(fd_, -1));
}

}  // namespace reliefbench
