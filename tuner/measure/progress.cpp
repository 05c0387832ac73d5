#include "tuner/measure/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "kernels/base/console.h"

namespace reliefbench {
namespace {

constexpr int kBarWidth = 30;
constexpr std::string_view kClearLine = "\r\033[2K";

std::string clock_text(double seconds) {
  const long whole = std::lround(seconds);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

}  // namespace

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { finish(); }

void Progress::update(double fraction, std::string_view label) {
  fraction_ = std::max(fraction_, std::clamp(fraction, 0.0, 1.0));
  if (Clock::now() - last_ >= (terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(10000)))
    show(label);
}

void Progress::wait(std::string_view why) { show(why); }

void Progress::show(std::string_view label) {
  if (quiet_) return;
  const Clock::time_point now = Clock::now();
  if (last_ == Clock::time_point{}) {
    start_ = now;
    start_fraction_ = fraction_;
  }
  last_ = now;
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  const double done = fraction_ - start_fraction_;
  const std::string left =
      done > 0.01 ? clock_text(elapsed_s * (1 - fraction_) / done) + " left" : std::string("estimating");
  if (!terminal_) {
    write_stderr(fmt::format("{:3.0f} %  {} passed, {}  {}\n", fraction_ * 100, clock_text(elapsed_s), left, label));
    return;
  }
  const int filled = static_cast<int>(fraction_ * kBarWidth);
  write_stderr(fmt::format("{}[{:=<{}}{: <{}}] {:3.0f} %  {}  {}", kClearLine, "", filled, "", kBarWidth - filled,
                           fraction_ * 100, left, label.substr(0, 60)));
  drawn_ = true;
}

void Progress::note(std::string_view line) {
  if (quiet_) return;
  write_stderr(fmt::format("{}{}\n", drawn_ ? kClearLine : "", one_line(line)));
  drawn_ = false;
}

void Progress::finish() {
  if (drawn_) write_stderr(kClearLine);
  drawn_ = false;
  last_ = {};
  fraction_ = 0;
}

}  // namespace reliefbench
