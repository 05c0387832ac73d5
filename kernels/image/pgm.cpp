#include "kernels/image/pgm.h"

#include <charconv>
#include <string>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

bool is_space(std::uint8_t byte) { return byte == ' ' || (byte >= '\t' && byte <= '\r'); }

/// The next decimal number of the header, behind blanks and comments; 0 if there is none that fits.
int take_number(std::span<const std::uint8_t>& rest) {
  bool in_comment = false;
  while (!rest.empty() && (in_comment || is_space(rest[0]) || rest[0] == '#')) {
    in_comment = rest[0] == '#' || (in_comment && rest[0] != '\n');
    rest = rest.subspan(1);
  }
  const char* begin = reinterpret_cast<const char*>(rest.data());
  int number = 0;
  const auto [end, error] = std::from_chars(begin, begin + rest.size(), number);
  rest = rest.subspan(static_cast<std::size_t>(end - begin));
  return error == std::errc() ? number : 0;
}

}  // namespace

bool has_pgm_signature(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 3 && bytes[0] == 'P' && bytes[1] == '5' && (is_space(bytes[2]) || bytes[2] == '#');
}

Image decode_pgm(std::span<const std::uint8_t> bytes, const std::filesystem::path& path) {
  std::span<const std::uint8_t> rest = bytes.subspan(2);
  const int width = take_number(rest);
  const int height = take_number(rest);
  const int max_code = take_number(rest);
  // Exactly one blank parts the header from the pixels.
  if (width < 1 || height < 1 || max_code < 1 || max_code > 65535 || rest.empty() || !is_space(rest[0]))
    fail_input("{}: the PGM header is broken; width, height and a maximum up to 65535 were expected", path.string());
  rest = rest.subspan(1);
  const std::size_t bytes_per_pixel = max_code > 255 ? 2 : 1;
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (rest.size() / bytes_per_pixel < count) fail_input("{}: the PGM is truncated", path.string());

  Image image{.width = width, .height = height, .channels = {"Y"}, .alpha = -1, .pixels = {}};
  image.pixels.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = i * bytes_per_pixel;
    const int code = bytes_per_pixel == 2 ? rest[at] * 256 + rest[at + 1] : rest[at];  // big-endian
    image.pixels.push_back(static_cast<float>(code) / static_cast<float>(max_code));
  }
  return image;
}

}  // namespace reliefbench
