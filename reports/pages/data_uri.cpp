#include "reports/pages/data_uri.h"

#include <algorithm>
#include <cstdint>
#include <system_error>

#include "kernels/base/append_file.h"

namespace reliefbench {

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::string_view group = bytes.substr(i, 3);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (k < group.size() ? static_cast<std::uint8_t>(group[k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= group.size() ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::optional<std::string> png_data_uri(const std::filesystem::path& folder, const std::filesystem::path& picture) {
  std::error_code error;
  const std::filesystem::path root = std::filesystem::canonical(folder, error);
  const std::filesystem::path path = std::filesystem::canonical(folder / picture, error);
  if (error || !std::filesystem::is_regular_file(path, error)) return std::nullopt;
  const auto [root_end, differs_at] = std::ranges::mismatch(root, path);
  if (root_end != root.end()) return std::nullopt;
  return "data:image/png;base64," + base64(read_file(path));
}

}  // namespace reliefbench
