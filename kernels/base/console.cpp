#include "kernels/base/console.h"

#include <fmt/format.h>
#include <unistd.h>

#include "kernels/base/uninterrupted.h"

namespace reliefbench {
namespace {

/// Bytes of the well-formed UTF-8 character that the text begins with; 0: none (RFC 3629).
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const auto follows = [&](std::size_t i, unsigned least = 0x80, unsigned most = 0xbf) {
    return byte(i) >= least && byte(i) <= most;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first <= 0xdf) return follows(1) ? 2 : 0;
  if (first >= 0xe0 && first <= 0xef)  // neither overlong nor a surrogate
    return follows(1, first == 0xe0 ? 0xa0 : 0x80, first == 0xed ? 0x9f : 0xbf) && follows(2) ? 3 : 0;
  if (first >= 0xf0 && first <= 0xf4)
    return follows(1, first == 0xf0 ? 0x90 : 0x80, first == 0xf4 ? 0x8f : 0xbf) && follows(2) && follows(3) ? 4 : 0;
  return 0;
}

/// C0 and C1 controls, DEL, line and paragraph separators, and marks that turn the direction of writing.
bool is_control(std::string_view character) {
  const auto first = static_cast<unsigned char>(character[0]);
  if (character.size() == 1) return first < 0x20 || first == 0x7f;
  if (character.size() == 2) return first == 0xc2 && static_cast<unsigned char>(character[1]) < 0xa0;
  return character >= "\u2028" && character <= "\u202e" && character.size() == 3;
}

std::string escaped(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text.substr(i));
    const std::string_view character = text.substr(i, length == 0 ? 1 : length);
    i += character.size();
    if (length > 0 && !is_control(character))
      out += character;
    else if (character == "\n")
      out += "\\n";
    else
      for (const char c : character) out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  }
  return out;
}

void print_line(const char* before, std::string_view message) noexcept {
  try {
    write_stderr(before + one_line(message) + "\n");
  } catch (const std::bad_alloc&) {
    write_stderr("reliefbench: out of memory\n");
  }
}

}  // namespace

std::string one_line(std::string_view text) {
  if (text.size() <= kLongestLine) return escaped(text);
  constexpr std::size_t kTail = kLongestLine / 4;  // what was expected often stands at the end
  constexpr std::size_t kHead = kLongestLine - kTail;
  return fmt::format("{} ... ({} bytes left out) ... {}", escaped(text.substr(0, kHead)), text.size() - kLongestLine,
                     escaped(text.substr(text.size() - kTail)));
}

void write_stderr(std::string_view bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t written = uninterrupted([&] { return ::write(STDERR_FILENO, bytes.data(), bytes.size()); });
    if (written <= 0) return;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

void print_error(std::string_view message) noexcept { print_line("reliefbench: ", message); }

void print_warning(std::string_view message) noexcept { print_line("reliefbench: warning: ", message); }

}  // namespace reliefbench
