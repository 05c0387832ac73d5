#pragma once
#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace reliefbench {

/// What the process returns; the numbers are part of the command line's contract.
enum class Exit {
  done = 0,
  answer_is_no = 1,  ///< a regression was found, or nothing meets the budget
  bad_input = 2,     ///< usage, configuration or file at fault
  environment = 3,   ///< no such device, no valid timer, driver failure
  inconclusive = 4,
  nothing_measured = 5,
};

/// What failed, as far as a caller acts on it; the words of an error are for people only.
enum class Fault {
  other,
  device_lost,
  timeout,        ///< the device did not come to the end of what it drew
  out_of_memory,  ///< the device's or the host's
  invalid_timer,  ///< a timer gave a time that is not finite and above zero
};

/// Whether nothing works on a device any more, until it is opened again.
[[nodiscard]] inline bool needs_reopening(Fault fault) {
  return fault == Fault::device_lost || fault == Fault::timeout;
}

/// The base of all our exceptions. `what()` is the one line that a user reads: file, line or key, what was expected.
class Error : public std::runtime_error {
 public:
  Error(Exit code, const std::string& message, Fault fault = Fault::other)
      : std::runtime_error(message), code_(code), fault_(fault) {}
  [[nodiscard]] Exit code() const { return code_; }
  [[nodiscard]] Fault fault() const { return fault_; }

 private:
  Exit code_;
  Fault fault_;
};

/// A device that was lost and does not work when it is opened again. It is never a case's own failure: all ends.
class DeviceGone : public Error {
 public:
  explicit DeviceGone(const std::string& message) : Error(Exit::environment, message) {}
};

template <typename... Args>
[[noreturn]] void fail_input(fmt::format_string<Args...> text, Args&&... args) {
  throw Error(Exit::bad_input, fmt::format(text, std::forward<Args>(args)...));
}

template <typename... Args>
[[noreturn]] void fail_environment(fmt::format_string<Args...> text, Args&&... args) {
  throw Error(Exit::environment, fmt::format(text, std::forward<Args>(args)...));
}

/// fail_environment() with what failed.
template <typename... Args>
[[noreturn]] void fail_device(Fault fault, fmt::format_string<Args...> text, Args&&... args) {
  throw Error(Exit::environment, fmt::format(text, std::forward<Args>(args)...), fault);
}

}  // namespace reliefbench
