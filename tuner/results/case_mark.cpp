#include "tuner/results/case_mark.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <utility>

#include "kernels/base/append_file.h"
#include "kernels/base/file_error.h"
#include "kernels/base/stop_signals.h"
#include "kernels/base/uninterrupted.h"

namespace reliefbench {
namespace {

// The file is one line, "T CASE": 1 where the start before ended in this case for the first time, else 0, and the
// case's id, which is empty between cases. It is written in place, in one call, so that it costs a batch of frames next
// to nothing; what an earlier, longer line leaves behind the new line's end does not count.
constexpr std::size_t kCaseAt = 2;

constexpr std::string_view kNoCase = "0 \n";

std::atomic<int> marked_fd = -1;  ///< whose mark a signal clears
static_assert(std::atomic<int>::is_always_lock_free, "else a handler may not read it");

/// Whether it was written, also in a handler of signals; else errno says why not.
bool write_mark(int fd, std::string_view line) {
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t written =
        uninterrupted([&] { return ::pwrite(fd, line.data() + done, line.size() - done, static_cast<off_t>(done)); });
    if (written == 0) errno = ENOSPC;
    if (written <= 0) return false;
    done += static_cast<std::size_t>(written);
  }
  return true;
}

void clear_mark(int fd) { static_cast<void>(write_mark(fd, kNoCase)); }

/// Then the process ends as it would have done without.
extern "C" void on_stop(int signal) {
  clear_mark(marked_fd);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

/// In the place of one handler of stops, and of no other.
void replace_handler(void (*from)(int), void (*to)(int)) {
  for (const int signal : kStopSignals) {
    struct sigaction now {};
    if (::sigaction(signal, nullptr, &now) == 0 && now.sa_handler == from) std::signal(signal, to);
  }
}

std::optional<CaseMark::Death> parse(std::string_view text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  if (line.size() == text.size() || line.size() <= kCaseAt) return std::nullopt;
  CaseMark::Death death{.case_id = std::string(line.substr(kCaseAt))};
  int times = 0;
  std::from_chars(line.data(), line.data() + 1, times);
  death.times = times % 2 + 1;  // earlier builds counted on, to 9
  return death;
}

}  // namespace

CaseMark::CaseMark(std::filesystem::path path) : path_(std::move(path)) {
  constexpr int kFlags = O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  fd_ = uninterrupted([&] { return ::open(path_.c_str(), kFlags, 0666); });
  if (fd_ < 0) fail_file(path_, "cannot be written", errno);
  try {
    death_ = parse(read_file(path_));
  } catch (...) {
    ::close(fd_);
    throw;
  }
  clear();
  outer_fd_ = marked_fd.exchange(fd_);
  replace_handler(SIG_DFL, on_stop);
}

CaseMark::~CaseMark() {
  if (outer_fd_ < 0) replace_handler(on_stop, SIG_DFL);
  marked_fd = outer_fd_;
  ::unlink(path_.c_str());
  ::close(fd_);
}

void CaseMark::set(std::string_view case_id) {
  const bool has_ended_once = death_ && death_->case_id == case_id && !death_->is_its_fault();
  const std::string line = fmt::format("{} {}\n", has_ended_once ? 1 : 0, case_id);
  if (!write_mark(fd_, line)) fail_file(path_, "cannot be written", errno);
}

void CaseMark::clear() noexcept { clear_mark(fd_); }

}  // namespace reliefbench
