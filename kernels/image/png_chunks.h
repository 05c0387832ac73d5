#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace reliefbench {

[[nodiscard]] bool has_png_signature(std::span<const std::uint8_t> bytes);

/// The PNG with only the chunks that pixels depend on (IHDR, PLTE, tRNS, IDAT, IEND). libpng reports damage and odd
/// colour profiles straight to stderr, so damage is found here, and profiles never reach it.
/// path: for messages only
/// throws: Error(bad_input): truncated, or a chunk's CRC is wrong
[[nodiscard]] std::vector<std::uint8_t> checked_png(std::span<const std::uint8_t> bytes,
                                                    const std::filesystem::path& path);

}  // namespace reliefbench
