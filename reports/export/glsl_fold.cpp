#include "reports/export/glsl_fold.h"

#include <algorithm>
#include <optional>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

using Lines = std::vector<std::string>;

std::size_t indent_of(std::string_view line) { return std::min(line.find_first_not_of(' '), line.size()); }

std::optional<int> value_of(std::string_view word, const GlslConstants& constants) {
  const auto found = constants.find(word);
  return found == constants.end() ? std::nullopt : std::optional(found->second);
}

/// "A == B" or "A != B" of constants.
std::optional<bool> comparison(std::string_view text, const GlslConstants& constants) {
  for (const std::string_view sign : {" == ", " != "}) {
    const std::size_t at = text.find(sign);
    if (at == std::string_view::npos) continue;
    const std::optional<int> left = value_of(text.substr(0, at), constants);
    const std::optional<int> right = value_of(text.substr(at + sign.size()), constants);
    if (left && right) return (*left == *right) == (sign == " == ");
  }
  return std::nullopt;
}

/// What constants leave of a condition: "true", "false", or what it then depends on.
std::string condition_left(std::string_view condition, const GlslConstants& constants) {
  const std::size_t both = std::min(condition.find(" && "), condition.find(" || "));
  const std::optional<bool> first = comparison(condition.substr(0, both), constants);
  if (!first) return std::string(condition);
  if (both == std::string_view::npos) return *first ? "true" : "false";
  const bool is_and = condition.substr(both, 4) == " && ";
  if (*first != is_and) return *first ? "true" : "false";
  return std::string(condition.substr(both + 4));
}

/// Where an expression that begins at `at` ends: before a `,`, `:`, `;` or a parenthesis that it did not open.
std::size_t expression_end(std::string_view text, std::size_t at) {
  int depth = 0;
  for (; at < text.size(); ++at) {
    const char c = text[at];
    if (depth == 0 && (c == ',' || c == ':' || c == ';' || c == ')')) break;
    depth += c == '(' ? 1 : (c == ')' ? -1 : 0);
  }
  return at;
}

/// A line without the `A == B ? x : y` that constants decide, where the condition stands first in its expression and
/// both choices on the line.
std::string without_choices(std::string line, const GlslConstants& constants) {
  for (std::size_t mark = line.find(" ? "); mark != std::string::npos; mark = line.find(" ? ", mark + 1)) {
    const std::string_view text = code_of(line);
    if (mark >= text.size()) break;
    std::size_t begin = 0;
    for (const std::string_view before : {"(", "return ", " = ", ", ", ": "})
      if (const std::size_t at = text.rfind(before, mark); at != std::string_view::npos)
        begin = std::max(begin, at + before.size());
    const std::optional<bool> is_true = comparison(text.substr(begin, mark - begin), constants);
    const std::size_t middle = expression_end(text, mark + 3);
    if (!is_true || middle >= text.size() || text[middle] != ':') continue;
    const std::size_t end = expression_end(text, middle + 2);
    if (end >= text.size()) continue;
    const std::string kept(*is_true ? text.substr(mark + 3, middle - 1 - (mark + 3))
                                    : text.substr(middle + 2, end - middle - 2));
    line.replace(begin, end - begin, kept);
    mark = begin;
  }
  return line;
}

/// First line from `begin` on that has no deeper indent than `indent`: `}`, `} else {` or what follows a statement.
std::size_t end_of_deeper(const Lines& lines, std::size_t begin, std::size_t indent) {
  while (begin < lines.size() && (lines[begin].empty() || indent_of(lines[begin]) > indent)) ++begin;
  return begin;
}

/// The line that ends the block whose lines begin at `begin`.
std::size_t end_of_block(const Lines& lines, std::size_t begin, std::size_t indent) {
  const std::size_t end = end_of_deeper(lines, begin, indent);
  if (end == lines.size()) fail_environment("shader text: \"{}\" opens a block that nothing ends", lines[begin - 1]);
  return end;
}

/// The lines of a statement that an `if` at `at` stands before, moved out to its indent, and the lines of its `else`.
struct Branches {
  Lines then;
  Lines otherwise;
  std::size_t end = 0;  ///< first line after all of it
};

Lines moved_out(const Lines& lines, std::size_t begin, std::size_t end) {
  Lines out;
  for (std::size_t i = begin; i < end; ++i) out.push_back(lines[i].substr(std::min<std::size_t>(lines[i].size(), 2)));
  return out;
}

Branches branches_of(const Lines& lines, std::size_t at, std::size_t after_condition) {
  const std::size_t indent = indent_of(lines[at]);
  const std::string_view statement = std::string_view(lines[at]).substr(after_condition);
  Branches branches;
  if (!code_of(statement).ends_with('{')) {
    branches.end = end_of_deeper(lines, at + 1, indent);
    branches.then = moved_out(lines, at + 1, branches.end);
    if (!code_of(statement).empty())
      branches.then.insert(branches.then.begin(), std::string(indent, ' ') + std::string(statement.substr(1)));
    return branches;
  }
  const std::size_t middle = end_of_block(lines, at + 1, indent);
  branches.then = moved_out(lines, at + 1, middle);
  branches.end = middle + 1;
  if (lines[middle].find("else {") == std::string::npos) return branches;
  const std::size_t last = end_of_block(lines, middle + 1, indent);
  branches.otherwise = moved_out(lines, middle + 1, last);
  branches.end = last + 1;
  return branches;
}

}  // namespace

std::vector<std::string> text_lines(std::string_view text) {
  Lines lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::string_view code_of(std::string_view line) {
  line = line.substr(0, line.find("//"));
  return line.substr(0, line.find_last_not_of(' ') + 1);
}

std::size_t closing(std::string_view text, std::size_t open) {
  int depth = 0;
  for (std::size_t i = open; i < text.size(); ++i) {
    depth += text[i] == '(' ? 1 : 0;
    if (text[i] == ')' && --depth == 0) return i;
  }
  return std::string_view::npos;
}

std::string folded(std::string_view text, const GlslConstants& constants) {
  Lines lines = text_lines(text);
  for (std::string& line : lines) line = without_choices(line, constants);
  for (std::size_t i = 0; i < lines.size();) {
    const std::size_t indent = indent_of(lines[i]);
    const std::string_view code = code_of(lines[i]);
    const bool is_if = code.size() > indent && code.substr(indent).starts_with("if (");
    const std::size_t open = indent + 3;
    const std::size_t close = is_if ? closing(code, open) : std::string_view::npos;
    if (close == std::string_view::npos) {
      ++i;
      continue;
    }
    const std::string before(code.substr(open + 1, close - open - 1));
    const std::string left = condition_left(before, constants);
    if (left != "true" && left != "false") {
      lines[i].replace(open + 1, before.size(), left);
      ++i;
      continue;
    }
    const Branches branches = branches_of(lines, i, close + 1);
    const Lines& kept = left == "true" ? branches.then : branches.otherwise;
    const bool returns = !kept.empty() && indent == 2 && kept.back().starts_with("  return");
    const std::size_t end = returns ? std::max(branches.end, lines.size() - 1) : branches.end;  // before the last "}"
    const auto begin = lines.begin() + static_cast<std::ptrdiff_t>(i);
    lines.insert(lines.erase(begin, lines.begin() + static_cast<std::ptrdiff_t>(end)), kept.begin(), kept.end());
  }
  std::string out;
  for (const std::string& line : lines) out += line + "\n";
  return out;
}

}  // namespace reliefbench
