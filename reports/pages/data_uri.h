#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace reliefbench {

[[nodiscard]] std::string base64(std::string_view bytes);  ///< RFC 4648, padded

/// A picture as a WebP. rgba8: width x height
[[nodiscard]] std::string webp_uri(int width, int height, std::span<const std::uint8_t> rgba8);

/// A PNG file of a folder as a data URI; none where there is no such file, or it lies outside of the folder: what a run
/// folder from elsewhere names, "../../mine.png" or a link, is not to get into a page.
/// picture: relative to the folder
[[nodiscard]] std::optional<std::string> png_data_uri(const std::filesystem::path& folder,
                                                      const std::filesystem::path& picture);

/// The same as a WebP of a fifth of the size, where the file is a PNG; any other file as it is.
[[nodiscard]] std::optional<std::string> photo_data_uri(const std::filesystem::path& folder,
                                                        const std::filesystem::path& picture);

}  // namespace reliefbench
