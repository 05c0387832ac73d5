#pragma once
#include <fmt/core.h>

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tuner/results/json_text.h"
#include "tuner/results/record.h"

namespace reliefbench {

/// Colours text, or leaves it as it is.
class Paint {
 public:
  explicit Paint(bool on) : on_(on) {}
  [[nodiscard]] std::string bold(std::string_view text) const { return painted(text, "1"); }
  [[nodiscard]] std::string dim(std::string_view text) const { return painted(text, "2"); }
  [[nodiscard]] std::string bad(std::string_view text) const { return painted(text, "31"); }
  [[nodiscard]] std::string good(std::string_view text) const { return painted(text, "32"); }

 private:
  [[nodiscard]] std::string painted(std::string_view text, std::string_view code) const;
  bool on_;
};
/// Colour if stdout is a terminal and NO_COLOR is unset or empty (https://no-color.org).
[[nodiscard]] Paint paint_for_stdout();

[[nodiscard]] std::string format_time_ns(double time_ns);              ///< "1.234 ms", four digits, ns to s
[[nodiscard]] std::string format_interval_ns(const Summary& summary);  ///< "1.234 ms [1.200, 1.301; 97.9 %]"
[[nodiscard]] std::string format_bytes(std::int64_t bytes);            ///< "64.0 KiB"
[[nodiscard]] std::string format_number(double value);                 ///< four digits, no needless zeros

/// Rows of cells as left-aligned columns, two spaces between, each row on its own line after `indent`. Rows may differ
/// in length; colour does not count as width.
[[nodiscard]] std::string columns(std::span<const std::vector<std::string>> rows, std::string_view indent = "");

/// Width of the terminal on stdout; 120 where stdout is no terminal.
[[nodiscard]] std::size_t line_width();

/// Text whose lines are at most `width` wide: longer ones are broken at spaces, and go on indented by `hang` more.
/// A word that is wider stands alone. Colour does not count as width.
/// mark: stands at the end of each broken line, e.g. " \\" in a command
[[nodiscard]] std::string fitted(std::string_view text, std::size_t width, std::string_view mark = "",
                                 std::size_t hang = 4);

/// Prints what a person reads, fitted to the terminal.
template <typename... T>
void put(fmt::format_string<T...> format, T&&... arguments) {
  fmt::print("{}", fitted(fmt::format(format, std::forward<T>(arguments)...), line_width()));
}

/// Prints a document; what is no UTF-8, as a path's bytes may be, comes as U+FFFD.
template <typename Json>
void print_json(const Json& document, int indent) {
  fmt::print("{}\n", json_text(document, indent));
}

/// Prints a line that is to be copied into a shell.
void put_command(std::string_view line);

/// Where a run's results are, and the command that asks of them.
void print_next_recommend(const std::filesystem::path& run);

/// Text as one word of a shell.
[[nodiscard]] std::string shell_quoted(std::string_view text);

}  // namespace reliefbench
