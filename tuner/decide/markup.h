#pragma once
#include <string>
#include <string_view>

namespace reliefbench {

/// Text as XML 1.0 holds it, in elements and attributes: what XML has no place for (control characters, bytes that are
/// no UTF-8) is replaced.
[[nodiscard]] std::string xml_escaped(std::string_view text);

/// Text that Markdown takes for text, on one line.
[[nodiscard]] std::string markdown_escaped(std::string_view text);

}  // namespace reliefbench
