#include "tuner/decide/markup.h"

#include <cstddef>

namespace reliefbench {
namespace {

/// Length of the UTF-8 sequence of a character that XML allows at the text's beginning; 0: there is none.
/// source: RFC 3629; XML 1.0, production 2
std::size_t xml_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(i < text.size() ? text[i] : 0); };
  const auto goes_on = [&](std::size_t i) { return (byte(i) & 0xC0U) == 0x80U; };
  const unsigned first = byte(0);
  if (first < 0x80) return first >= 0x20 || first == '\t' || first == '\n' || first == '\r' ? 1 : 0;
  if (first >= 0xC2 && first <= 0xDF) return goes_on(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    const unsigned code = ((first & 0x0FU) << 12U) | ((byte(1) & 0x3FU) << 6U) | (byte(2) & 0x3FU);
    const bool is_character = code >= 0x800 && !(code >= 0xD800 && code <= 0xDFFF) && code < 0xFFFE;
    return goes_on(1) && goes_on(2) && is_character ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    const unsigned code = ((first & 0x07U) << 18U) | ((byte(1) & 0x3FU) << 12U);
    return goes_on(1) && goes_on(2) && goes_on(3) && code >= 0x10000 && code <= 0x10FFFF ? 4 : 0;
  }
  return 0;
}

}  // namespace

std::string xml_escaped(std::string_view text) {
  std::string escaped;
  while (!text.empty()) {
    const std::size_t length = xml_character(text);
    switch (text.front()) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        if (length == 0)
          escaped += static_cast<unsigned char>(text.front()) < 0x20 ? " " : "\xEF\xBF\xBD";
        else
          escaped += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return escaped;
}

std::string markdown_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (std::string_view("\\`*_{}[]<>#|").find(c) != std::string_view::npos) escaped += '\\';
    escaped += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return escaped;
}

}  // namespace reliefbench
