#pragma once
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// What a shader is cut down to.
struct GlslCut {
  std::vector<std::string> files;                  ///< of the binary's shaders, in the order of their text
  std::set<std::string> roots;                     ///< functions that must stay
  std::map<int, int> constants{};                  ///< specialization constants by id: become constants of this value
  std::map<std::string, std::string> generated{};  ///< files that are none of the binary's: name, text
};

/// Shader files as one text: every `#include` is put in its place, once, and of all top-level declarations those stay,
/// with their comments, that the roots need, without the `if`s that constants decide (glsl_fold.h).
/// It knows the shaders of this project, not GLSL: includes first, a declaration's last line ends in `;` or `}`.
/// throws: Error(environment): no such file
[[nodiscard]] std::string cut_glsl(const GlslCut& cut);

}  // namespace reliefbench
