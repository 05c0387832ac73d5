#include "reports/export/template.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "kernels/base/embedded.h"
#include "kernels/base/error.h"
#include "reports/export/glsl_fold.h"

namespace reliefbench {

const std::vector<EmbeddedFile>& embedded_templates();  // reports/export/templates/*

namespace {

/// The line without its condition; nothing where that does not hold.
std::optional<std::string_view> unconditional(std::string_view line, const TemplateValues& values) {
  if (line.empty() || (line.front() != '?' && line.front() != '!')) return line;
  const std::size_t end = std::min(line.find(' '), line.size());
  const bool is_set = values.flags.contains(line.substr(1, end - 1));
  if (is_set != (line.front() == '?')) return std::nullopt;
  return line.substr(std::min(end + 1, line.size()));
}

std::string with_words(std::string_view line, const TemplateValues& values) {
  std::string out;
  while (!line.empty()) {
    const std::size_t open = line.find('@');
    const std::size_t close = open == std::string_view::npos ? open : line.find('@', open + 1);
    const bool is_word = close != std::string_view::npos &&
                         line.substr(open + 1, close - open - 1).find_first_not_of("abcdefghijklmnopqrstuvwxyz_") ==
                             std::string_view::npos;
    if (!is_word || close == open + 1) {
      const std::size_t end = open == std::string_view::npos ? line.size() : open + 1;
      out += line.substr(0, end);
      line.remove_prefix(end);
      continue;
    }
    out += line.substr(0, open);
    const std::string name(line.substr(open + 1, close - open - 1));
    const auto word = values.words.find(name);
    if (word == values.words.end()) fail_environment("a template wants '{}', which has no value", name);
    out += word->second;
    line.remove_prefix(close + 1);
  }
  return out;
}

}  // namespace

std::string filled_template(std::string_view name, const TemplateValues& values) {
  std::string text;
  for (const std::string& line : text_lines(embedded_text(embedded_templates(), name))) {
    const auto kept = unconditional(line, values);
    if (!kept) continue;
    const std::string filled = with_words(*kept, values);
    if (filled.empty() && text.ends_with("\n\n")) continue;  // what stood between went
    text += filled + (filled.ends_with('\n') ? "" : "\n");
  }
  return text;
}

}  // namespace reliefbench
