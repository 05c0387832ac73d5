#include "reports/export/ray_text.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "kernels/base/embedded.h"
#include "reports/export/glsl_fold.h"
#include "reports/export/shader_pieces.h"

namespace reliefbench {
namespace {

constexpr std::array<std::string_view, 3> kRayNames{"BENT_RAYS", "BENT_EXACTLY", "CURVED"};
constexpr std::string_view kIfDefined = "#ifdef ";

/// A text's parts between commas that no parenthesis holds, without the spaces before them.
std::vector<std::string> listed(std::string_view text) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char c : text) {
    depth += c == '(' ? 1 : (c == ')' ? -1 : 0);
    if (depth == 0 && c == ',')
      parts.emplace_back();
    else if (c != ' ' || !parts.back().empty())
      parts.back() += c;
  }
  return parts;
}

}  // namespace

RayText::RayText(std::set<std::string> defines) : defines_(std::move(defines)) {
  constexpr std::string_view kDefine = "#define ";
  for (const std::string& line : chosen(text_lines(embedded_text(embedded_shaders(), "ray.glsl")))) {
    const std::size_t open = line.find('(');
    if (!line.starts_with(kDefine) || open == std::string::npos) continue;
    const std::size_t close = closing(line, open);
    macros_.push_back({.name = line.substr(kDefine.size(), open - kDefine.size()),
                       .params = listed(std::string_view(line).substr(open + 1, close - open - 1)),
                       .body = line.substr(std::min(close + 2, line.size()))});
  }
}

std::string RayText::Macro::called_with(const std::string& arguments) const {
  const std::vector<std::string> values = params.size() == 1 ? std::vector{arguments} : listed(arguments);
  std::string text;
  std::string word;
  for (const char c : body + " ") {
    if (is_word_character(c)) {
      word += c;
      continue;
    }
    const auto param = static_cast<std::size_t>(std::ranges::find(params, word) - params.begin());
    text += param < values.size() ? values[param] : word;
    text += c;
    word.clear();
  }
  text.pop_back();
  return text;
}

std::vector<std::string> RayText::chosen(std::vector<std::string> lines) const {
  struct Condition {
    bool is_ours;
    bool holds;
  };
  std::vector<Condition> open;
  std::vector<std::string> kept;
  for (std::string& line : lines) {
    if (line.starts_with("#if")) {
      const std::string name = line.starts_with(kIfDefined) ? line.substr(kIfDefined.size()) : "";
      const bool is_ours = std::ranges::find(kRayNames, name) != kRayNames.end();
      open.push_back({.is_ours = is_ours, .holds = !is_ours || defines_.contains(name)});
      if (is_ours) continue;
    } else if (!open.empty() && open.back().is_ours && line == "#else") {
      open.back().holds = !open.back().holds;
      continue;
    } else if (!open.empty() && line.starts_with("#endif")) {
      const bool was_ours = open.back().is_ours;
      open.pop_back();
      if (was_ours) continue;
    }
    if (std::ranges::all_of(open, &Condition::holds)) kept.push_back(std::move(line));
  }
  return kept;
}

std::string RayText::without_macros(std::string line) const {
  for (const Macro& macro : macros_)
    for (std::size_t at = line.find(macro.name); at != std::string::npos; at = line.find(macro.name, at)) {
      const std::size_t open = at + macro.name.size();
      if (open >= line.size() || line[open] != '(') break;
      const std::size_t close = closing(line, open);
      if (close == std::string::npos) break;
      const std::string text = macro.called_with(line.substr(open + 1, close - open - 1));
      if (text.empty() && at > 0 && line[at - 1] == ' ' && line.find_first_not_of(' ') != at) --at;
      line.replace(at, close + 1 - at, text);
    }
  return line;
}

std::vector<std::string> RayText::written_out(std::vector<std::string> lines) const {
  std::vector<std::string> kept;
  for (std::string& line : chosen(std::move(lines))) {
    const bool was_blank = code_of(line).empty();
    std::string text = without_macros(std::move(line));
    if (was_blank || !code_of(text).empty()) kept.push_back(std::move(text));
  }
  return kept;
}

}  // namespace reliefbench
