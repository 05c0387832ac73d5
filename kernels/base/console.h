#pragma once
#include <string>
#include <string_view>

namespace reliefbench {

/// Text for one line of a terminal: control characters and bytes that are no UTF-8 are escaped ("\n", "\x1b"), and of a
/// long text the middle is left out.
[[nodiscard]] std::string one_line(std::string_view text);
inline constexpr std::size_t kLongestLine = 1000;  ///< bytes that one_line() keeps

/// Bytes to stderr as they are. A stderr that takes none is no error: there is nobody left to tell.
void write_stderr(std::string_view bytes) noexcept;

/// "reliefbench: MESSAGE" as one line on stderr: the one place where errors and warnings are printed.
void print_error(std::string_view message) noexcept;
/// "reliefbench: warning: MESSAGE"
void print_warning(std::string_view message) noexcept;

}  // namespace reliefbench
