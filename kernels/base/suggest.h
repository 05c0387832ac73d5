#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// "unknown (did you mean 'b'?; known: a, b)"
[[nodiscard]] std::string unknown_text(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace reliefbench
