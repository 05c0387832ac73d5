#include "kernels/base/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "kernels/base/error.h"

namespace reliefbench {

namespace fs = std::filesystem;

namespace {

std::string errno_text(int number) { return std::generic_category().message(number); }

}  // namespace

void write_atomically(const fs::path& path, std::string_view bytes) {
  const fs::path temporary = path.string() + fmt::format(".tmp{}", ::getpid());
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0) fail_input("{}: cannot be written: {}", path.string(), errno_text(errno));
  int failure = 0;
  for (std::string_view rest = bytes; !rest.empty() && failure == 0;) {
    const ssize_t written = ::write(fd, rest.data(), rest.size());
    if (written >= 0)
      rest.remove_prefix(static_cast<std::size_t>(written));
    else if (errno != EINTR)
      failure = errno;
  }
  if (failure == 0 && ::fsync(fd) != 0) failure = errno;
  if (::close(fd) != 0 && failure == 0) failure = errno;
  if (failure == 0 && ::rename(temporary.c_str(), path.c_str()) != 0) failure = errno;
  if (failure != 0) {
    ::unlink(temporary.c_str());
    fail_input("{}: cannot be written: {}", path.string(), errno_text(failure));
  }
  // The rename itself lasts only once the folder is on disk; file systems that cannot sync a folder need no such call.
  const fs::path parent = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const int folder = ::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  ::fsync(folder);
  ::close(folder);
}

}  // namespace reliefbench
