#pragma once
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// Values of constants by name.
using GlslConstants = std::map<std::string, int, std::less<>>;

[[nodiscard]] std::vector<std::string> text_lines(std::string_view text);
/// A line without its comment and the spaces before that.
[[nodiscard]] std::string_view code_of(std::string_view line);
/// The place of the parenthesis that closes the one at `open`; npos: none does.
[[nodiscard]] std::size_t closing(std::string_view text, std::size_t open);

/// A function without the `if`s that constants decide: `if (A == B)`, `if (A != B)`, alone or before `&&` or `||`.
/// After a `return` that is then unconditional, the rest goes. text: laid out by clang-format, as the shaders of this
/// project are
/// throws: Error(environment): a block that nothing ends
[[nodiscard]] std::string folded(std::string_view text, const GlslConstants& constants);

}  // namespace reliefbench
