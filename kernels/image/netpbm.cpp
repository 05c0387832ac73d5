#include <charconv>
#include <optional>

#include "kernels/base/error.h"
#include "kernels/image/decode.h"

namespace reliefbench {
namespace {

bool is_space(std::uint8_t byte) { return byte == ' ' || (byte >= '\t' && byte <= '\r'); }

/// The next decimal number, behind blanks and comments; none if what stands there is no number that fits.
std::optional<int> take_number(FileBytes& rest) {
  bool in_comment = false;
  while (!rest.empty() && (in_comment || is_space(rest[0]) || rest[0] == '#')) {
    in_comment = rest[0] == '#' || (in_comment && rest[0] != '\n');
    rest = rest.subspan(1);
  }
  const char* begin = reinterpret_cast<const char*>(rest.data());
  int number = 0;
  const auto [end, error] = std::from_chars(begin, begin + rest.size(), number);
  rest = rest.subspan(static_cast<std::size_t>(end - begin));
  return error == std::errc() ? std::optional(number) : std::nullopt;
}

/// The samples' codes, in decimal numbers or as big-endian bytes; a negative one where there is none.
class CodeReader {
 public:
  CodeReader(FileBytes rest, bool is_text, int max_code) : rest_(rest), is_text_(is_text), is_wide_(max_code > 255) {}

  /// Least length in bytes of so many codes.
  [[nodiscard]] std::size_t least_bytes(std::size_t count) const {
    return is_text_ ? 2 * count - 1 : count * (is_wide_ ? 2 : 1);
  }
  [[nodiscard]] int next() {
    if (is_text_) return take_number(rest_).value_or(-1);
    const int code = is_wide_ ? rest_[0] * 256 + rest_[1] : rest_[0];
    rest_ = rest_.subspan(is_wide_ ? 2 : 1);
    return code;
  }

 private:
  FileBytes rest_;
  bool is_text_;
  bool is_wide_;
};

}  // namespace

// PGM (P2, P5) and PPM (P3, P6), 8 or 16 bits: value/maximum, correctly rounded.
Image decode_netpbm(FileBytes bytes, const std::string& name) {
  const char kind = static_cast<char>(bytes[1]);
  const bool is_text = kind == '2' || kind == '3';
  const bool is_grey = kind == '2' || kind == '5';
  const char* const format = is_grey ? "PGM" : "PPM";
  FileBytes rest = bytes.subspan(2);
  const int width = take_number(rest).value_or(0);
  const int height = take_number(rest).value_or(0);
  const int max_code = take_number(rest).value_or(0);
  // Exactly one blank parts the header from the pixels.
  if (width < 1 || height < 1 || max_code < 1 || max_code > 65535 || rest.empty() || !is_space(rest[0]))
    fail_input("{}: the {} header is broken; width, height and a maximum up to 65535 were expected", name, format);
  rest = rest.subspan(1);
  const int channels = is_grey ? 1 : 3;
  check_shape(width, height, channels, name);
  const std::size_t count =
      static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(channels);
  CodeReader codes(rest, is_text, max_code);
  if (rest.size() < codes.least_bytes(count)) fail_input("{}: the {} is truncated", name, format);

  Image image = blank_image(width, height, channels, /*alpha=*/-1, max_code > 255 ? "16-bit" : "8-bit");
  for (std::size_t i = 0; i < count; ++i) {
    const int code = codes.next();
    if (code < 0) fail_input("{}: the {} is truncated or corrupt: {} of {} numbers are there", name, format, i, count);
    image.pixels.push_back(static_cast<float>(code) / static_cast<float>(max_code));
  }
  return image;
}

}  // namespace reliefbench
