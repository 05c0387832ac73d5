#include "reports/pages/data_uri.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <system_error>
#include <vector>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "kernels/image/image.h"

namespace reliefbench {
namespace {

/// The file with links followed; nothing where it is none, or lies outside of the folder.
std::optional<std::filesystem::path> file_within(const std::filesystem::path& folder,
                                                 const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::path root = std::filesystem::canonical(folder, error);
  const std::filesystem::path path = std::filesystem::canonical(folder / file, error);
  if (error || !std::filesystem::is_regular_file(path, error)) return std::nullopt;
  const auto [root_end, differs_at] = std::ranges::mismatch(root, path);
  return root_end == root.end() ? std::optional(path) : std::nullopt;
}

std::vector<std::uint8_t> codes_of(const Image& image) {
  std::vector<std::uint8_t> rgba8;
  rgba8.reserve(image.pixels.size());
  for (const float value : image.pixels) rgba8.push_back(static_cast<std::uint8_t>(std::lround(255 * value)));
  return rgba8;
}

std::string png_uri(const std::filesystem::path& path) { return "data:image/png;base64," + base64(read_file(path)); }

}  // namespace

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

std::string webp_uri(int width, int height, std::span<const std::uint8_t> rgba8) {
  const std::vector<std::uint8_t> webp = encode_webp(width, height, rgba8);
  return "data:image/webp;base64," + base64({reinterpret_cast<const char*>(webp.data()), webp.size()});
}

std::optional<std::string> png_data_uri(const std::filesystem::path& folder, const std::filesystem::path& picture) {
  const std::optional<std::filesystem::path> path = file_within(folder, picture);
  return path ? std::optional(png_uri(*path)) : std::nullopt;
}

std::optional<std::string> photo_data_uri(const std::filesystem::path& folder, const std::filesystem::path& picture) {
  const std::optional<std::filesystem::path> path = file_within(folder, picture);
  if (!path) return std::nullopt;
  try {
    const Image image = load_image(*path);
    if (image.channels.size() != 4) return png_uri(*path);
    return webp_uri(image.width, image.height, codes_of(image));
  } catch (const Error&) {
    return png_uri(*path);
  }
}

}  // namespace reliefbench
