#pragma once
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// A declaration or a block of preprocessor lines of a shader, with the comment above it; or a comment that stands
/// alone.
struct Piece {
  std::string file;
  std::string text;
  std::vector<std::string> names{};  ///< that it declares; none: a comment
  bool after_blank = false;          ///< a blank line stands before it
  bool is_needed = true;
  bool is_function = false;
};
using Pieces = std::vector<Piece>;

/// The top-level declarations of a text in GLSL, HLSL, MSL or WGSL as this project, SPIRV-Cross and naga write them.
/// throws: Error(environment): one that names nothing
[[nodiscard]] Pieces pieces_of(std::string_view text, const std::string& file = "");
/// Marks what the roots need, directly or through others, as needed, and nothing else; the comments of files that
/// something is needed of stay.
void keep_needed(Pieces& pieces, const std::set<std::string>& roots);
/// The needed ones, with the blank lines between them.
[[nodiscard]] std::string text_of(const Pieces& pieces);

/// Every identifier and number of the code.
[[nodiscard]] std::vector<std::string> words_of(std::string_view text);
[[nodiscard]] bool is_word_character(char c);

/// What a shader is cut down to.
struct GlslCut {
  std::vector<std::string> files;                  ///< of the binary's shaders, in the order of their text
  std::set<std::string> roots;                     ///< functions that must stay
  std::map<int, int> constants{};                  ///< specialization constants by id: become constants of this value
  std::map<std::string, std::string> generated{};  ///< files that are none of the binary's: name, text
  std::set<std::string> defines{};                 ///< of those that say what rays are (ray_text.h)
};

/// Shader files as one text: every `#include` is put in its place, once, and of all top-level declarations those are
/// needed, with their comments, that the roots need, without the `if`s that constants decide (glsl_fold.h).
/// It knows the shaders of this project, not GLSL: includes first, a declaration's last line ends in `;` or `}`.
/// throws: Error(environment): no such file, or one that is laid out in another way
[[nodiscard]] Pieces cut_glsl(const GlslCut& cut);

}  // namespace reliefbench
