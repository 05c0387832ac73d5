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

/// The one exception type. `what()` is the one line that a user reads: file, line or key, what was expected.
class Error : public std::runtime_error {
 public:
  Error(Exit code, const std::string& message) : std::runtime_error(message), code_(code) {}
  [[nodiscard]] Exit code() const { return code_; }

 private:
  Exit code_;
};

template <typename... Args>
[[noreturn]] void fail_input(fmt::format_string<Args...> text, Args&&... args) {
  throw Error(Exit::bad_input, fmt::format(text, std::forward<Args>(args)...));
}

template <typename... Args>
[[noreturn]] void fail_environment(fmt::format_string<Args...> text, Args&&... args) {
  throw Error(Exit::environment, fmt::format(text, std::forward<Args>(args)...));
}

}  // namespace reliefbench
