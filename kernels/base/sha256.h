#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace reliefbench {

/// SHA-256 of bytes as 64 lower-case hex digits (OpenSSL).
[[nodiscard]] std::string sha256(std::span<const std::byte> bytes);
[[nodiscard]] std::string sha256(std::string_view text);

}  // namespace reliefbench
