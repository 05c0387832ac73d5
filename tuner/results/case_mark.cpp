#include "tuner/results/case_mark.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <utility>

#include "kernels/base/append_file.h"
#include "kernels/base/file_error.h"

namespace reliefbench {
namespace {

// The file is one line, "SS T CASE": the signal in two digits, Death::times in one, and the case's id, which is empty
// between cases. It is written in place, in one call, so that it costs a batch of frames next to nothing; what an
// earlier, longer line leaves behind the new line's end does not count.
constexpr std::size_t kSignalDigits = 2;
constexpr std::size_t kCaseAt = 5;
constexpr int kMostTimes = 9;

constexpr std::array kFatalSignals = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

/// What the handler needs, which no argument can bring it.
struct Handling {
  std::atomic<int> fd = -1;
  std::array<struct sigaction, kFatalSignals.size()> before{};  // a sanitizer's, or the default
};
Handling& handling() {
  static Handling state;
  return state;
}

void restore_signals() {
  for (std::size_t i = 0; i < kFatalSignals.size(); ++i)
    ::sigaction(kFatalSignals.at(i), &handling().before.at(i), nullptr);
}

/// Enters the signal into the mark, then lets it do what it would have done. Only calls that a handler may make.
extern "C" void note_signal(int signal) {
  const std::array<char, kSignalDigits> digits = {static_cast<char>('0' + signal / 10),
                                                  static_cast<char>('0' + signal % 10)};
  static_cast<void>(!::pwrite(handling().fd, digits.data(), digits.size(), 0));
  restore_signals();
  ::raise(signal);
}

void handle_signals(int fd) {
  handling().fd = fd;
  struct sigaction action {};
  action.sa_handler = note_signal;
  for (std::size_t i = 0; i < kFatalSignals.size(); ++i)
    ::sigaction(kFatalSignals.at(i), &action, &handling().before.at(i));
}

std::optional<CaseMark::Death> parse(std::string_view text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  if (line.size() == text.size() || line.size() <= kCaseAt) return std::nullopt;
  CaseMark::Death death{.case_id = std::string(line.substr(kCaseAt))};
  std::from_chars(line.data(), line.data() + kSignalDigits, death.signal);
  int times = 0;
  std::from_chars(line.data() + kSignalDigits + 1, line.data() + kCaseAt, times);
  death.times = death.signal != 0 ? 0 : times + 1;
  return death;
}

}  // namespace

CaseMark::CaseMark(std::filesystem::path path) : path_(std::move(path)) {
  fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666);
  if (fd_ < 0) fail_file(path_, "cannot be written", errno);
  try {
    death_ = parse(read_file(path_));
  } catch (...) {
    ::close(fd_);
    throw;
  }
  clear();
  handle_signals(fd_);
}

CaseMark::~CaseMark() {
  restore_signals();
  ::unlink(path_.c_str());
  ::close(fd_);
}

void CaseMark::set(std::string_view case_id) {
  const int times = death_ && death_->case_id == case_id ? std::min(death_->times, kMostTimes) : 0;
  const std::string line = fmt::format("00 {} {}\n", times, case_id);
  if (::pwrite(fd_, line.data(), line.size(), 0) != static_cast<ssize_t>(line.size()))
    fail_file(path_, "cannot be written", errno != 0 ? errno : ENOSPC);
}

void CaseMark::clear() noexcept {
  constexpr std::string_view kNoCase = "00 0 \n";
  static_cast<void>(!::pwrite(fd_, kNoCase.data(), kNoCase.size(), 0));
}

}  // namespace reliefbench
