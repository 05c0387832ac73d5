#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace reliefbench {

/// The PNG with only the chunks that pixels depend on (IHDR, PLTE, tRNS, IDAT, IEND). libpng reports damage and odd
/// colour profiles straight to stderr, so damage is found here, and profiles never reach it.
/// name: for messages only
/// throws: Error(bad_input): truncated, or a chunk's CRC is wrong
[[nodiscard]] std::vector<std::uint8_t> checked_png(std::span<const std::uint8_t> bytes, const std::string& name);

}  // namespace reliefbench
