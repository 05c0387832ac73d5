#include "reports/export/straight_rays.h"

#include <array>
#include <string_view>

#include "reports/export/glsl_fold.h"

namespace reliefbench {
namespace {

/// What a macro of ray.glsl is for straight rays: its last argument between two texts, or nothing of it.
struct RayMacro {
  std::string_view name;
  std::string_view before;
  std::string_view after;
  bool has_argument = true;
};
constexpr std::array kRayMacros{RayMacro{"IF_BENT", "", "", false}, RayMacro{"RAY_END", "1.0", "", false},
                                RayMacro{"RAY_SHARE", "", ""}, RayMacro{"RAY_HEIGHT", "(1.0 - ", ")"}, RayMacro{"RAY_LOWEST", "(1.0 - ", ")"},
                                RayMacro{"RAY_AT_HEIGHT", "(1.0 - ", ")"}};

std::string written_out(std::string line) {
  for (const RayMacro& macro : kRayMacros)
    for (std::size_t at = line.find(macro.name); at != std::string::npos; at = line.find(macro.name, at)) {
      const std::size_t open = at + macro.name.size();
      if (open >= line.size() || line[open] != '(') break;
      const std::size_t close = closing(line, open);
      if (close == std::string::npos) break;
      std::size_t begin = open + 1;
      int depth = 0;
      for (std::size_t i = begin; i < close; ++i) {
        depth += line[i] == '(' ? 1 : (line[i] == ')' ? -1 : 0);
        if (depth == 0 && line[i] == ',') begin = i + 1;
      }
      begin = line.find_first_not_of(' ', begin);
      std::string text(macro.before);
      if (macro.has_argument) text += line.substr(begin, close - begin);
      text += macro.after;
      if (text.empty() && at > 0 && line[at - 1] == ' ' && line.find_first_not_of(' ') != at) --at;
      line.replace(at, close + 1 - at, text);
    }
  return line;
}

}  // namespace

std::vector<std::string> straight_rays(std::vector<std::string> lines) {
  std::vector<std::string> kept;
  bool is_ours = false;  // within such a condition
  bool is_left_out = false;
  for (std::string& line : lines) {
    if (line == "#ifdef BENT_RAYS" || line == "#ifdef CURVED") {
      is_ours = is_left_out = true;
    } else if (is_ours && line == "#else") {
      is_left_out = false;
    } else if (is_ours && line == "#endif") {
      is_ours = is_left_out = false;
    } else if (!is_left_out) {
      const bool was_blank = code_of(line).empty();
      std::string straight = written_out(std::move(line));
      if (was_blank || !code_of(straight).empty()) kept.push_back(std::move(straight));
    }
  }
  return kept;
}

}  // namespace reliefbench
