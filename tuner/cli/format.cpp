#include "tuner/cli/format.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "kernels/base/console.h"

namespace reliefbench {
namespace {

struct Unit {
  std::string_view id;
  double ns;
};
constexpr std::array kTimeUnits = {Unit{"s", 1e9}, Unit{"ms", 1e6}, Unit{"us", 1e3}, Unit{"ns", 1}};

const Unit& unit_of(double time_ns) {
  const auto* const fits = std::find_if(kTimeUnits.begin(), kTimeUnits.end(),
                                        [&](const Unit& unit) { return std::abs(time_ns) >= unit.ns; });
  return fits == kTimeUnits.end() ? kTimeUnits.back() : *fits;
}

/// Four significant digits, zeros kept, so that columns of one unit read alike.
std::string in_unit(double time_ns, const Unit& unit) {
  const double value = time_ns / unit.ns;
  const double magnitude = std::abs(value);
  const int decimals = magnitude < 10 ? 3 : (magnitude < 100 ? 2 : (magnitude < 1000 ? 1 : 0));
  return fmt::format("{:.{}f}", value, decimals);
}

std::size_t visible_width(std::string_view text) {
  std::size_t width = 0;
  bool in_escape = false;
  for (const char c : text) {
    if (c == '\x1b') in_escape = true;
    // Continuation bytes of UTF-8 are no characters of their own.
    if (!in_escape && (static_cast<unsigned char>(c) & 0xC0U) != 0x80U) ++width;
    if (c == 'm') in_escape = false;
  }
  return width;
}

constexpr std::size_t kPipedWidth = 120;
constexpr std::size_t kLeastWidth = 40;  // a terminal that says less is not believed

/// One line without its end, as fitted() has it.
std::string fitted_line(std::string_view line, std::size_t width, std::string_view mark, std::size_t more) {
  if (visible_width(line) <= width) return std::string(line);
  const std::size_t indent = std::min(line.find_first_not_of(' '), line.size());
  const std::string hang(indent + more, ' ');
  std::string text(line.substr(0, indent));
  std::size_t used = indent;
  for (std::size_t begin = indent; begin < line.size();) {
    const std::size_t word = std::min(line.find_first_not_of(' ', begin), line.size());  // its spaces come with it
    const std::size_t end = std::min(line.find(' ', word), line.size());
    const bool is_last = end == line.size();
    const std::size_t wide = visible_width(line.substr(begin, end - begin));
    if (used > hang.size() && used + wide + (is_last ? 0 : mark.size()) > width) {
      text.append(mark).append("\n").append(hang);
      used = hang.size() + wide - (word - begin);
      begin = word;
    } else {
      used += wide;
    }
    text += line.substr(begin, end - begin);
    begin = end;
  }
  return text;
}

}  // namespace

std::size_t line_width() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kPipedWidth;
  return std::max<std::size_t>(size.ws_col, kLeastWidth);
}

std::string fitted(std::string_view text, std::size_t width, std::string_view mark, std::size_t hang) {
  std::string lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines += fitted_line(text.substr(begin, end - begin), width, mark, hang);
    if (end < text.size()) lines += '\n';
    begin = end + 1;
  }
  return lines;
}

void put_command(std::string_view line) { fmt::print("{}\n", fitted(line, line_width(), " \\")); }

void print_next_recommend(const std::filesystem::path& run) {
  put("results in {}; next:\n", one_line(run.string()));
  put_command("  reliefbench recommend " + shell_quoted(run.string()));
}

std::string Paint::painted(std::string_view text, std::string_view code) const {
  return on_ ? fmt::format("\x1b[{}m{}\x1b[0m", code, text) : std::string(text);
}

Paint paint_for_stdout() {
  const char* const no_color = std::getenv("NO_COLOR");
  return Paint(isatty(STDOUT_FILENO) == 1 && (no_color == nullptr || *no_color == '\0'));
}

std::string format_time_ns(double time_ns) {
  const Unit& unit = unit_of(time_ns);
  return fmt::format("{} {}", in_unit(time_ns, unit), unit.id);
}

std::string format_interval_ns(const Summary& summary) {
  const Unit& unit = unit_of(summary.median);
  return fmt::format("{} {} [{}, {}; {}]", in_unit(summary.median, unit), unit.id, in_unit(summary.ci_low, unit),
                     in_unit(summary.ci_high, unit), coverage_text(summary.n));
}

std::string format_bytes(std::int64_t bytes) {
  constexpr std::array<std::string_view, 4> kUnits = {"B", "KiB", "MiB", "GiB"};
  auto value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 1024 && unit + 1 < kUnits.size()) {
    value /= 1024;
    ++unit;
  }
  return fmt::format("{:.{}f} {}", value, unit == 0 ? 0 : 1, kUnits.at(unit));
}

std::string format_number(double value) { return fmt::format("{:.4g}", value); }

std::string columns(std::span<const std::vector<std::string>> rows, std::string_view indent) {
  std::vector<std::size_t> widths;
  for (const std::vector<std::string>& row : rows) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], visible_width(row[i]));
  }
  std::string text;
  for (const std::vector<std::string>& row : rows) {
    text += indent;
    for (std::size_t i = 0; i < row.size(); ++i) {
      text += row[i];
      if (i + 1 < row.size()) text.append(widths[i] - visible_width(row[i]) + 2, ' ');
    }
    text.resize(text.find_last_not_of(' ') + 1);  // empty cells at the end
    text += '\n';
  }
  return text;
}

std::string shell_quoted(std::string_view text) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("-_./=:@%+,").find(c) != std::string_view::npos;
  };
  if (!text.empty() && std::all_of(text.begin(), text.end(), plain)) return std::string(text);
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace reliefbench
