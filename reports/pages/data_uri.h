#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace reliefbench {

[[nodiscard]] std::string base64(std::string_view bytes);  ///< RFC 4648, padded

/// A PNG file as a data URI; none where there is no such file.
[[nodiscard]] std::optional<std::string> png_data_uri(const std::filesystem::path& path);

}  // namespace reliefbench
