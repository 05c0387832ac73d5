#pragma once
#include <cstdint>
#include <filesystem>
#include <span>

#include "kernels/image/image.h"

namespace reliefbench {

[[nodiscard]] bool has_pgm_signature(std::span<const std::uint8_t> bytes);

/// A binary grey map (P5), 8 or 16 bits: value/maxval, correctly rounded. OpenImageIO 2.4 reads half of the 16-bit
/// codes one too low.
/// path: for messages only
/// throws: Error(bad_input): a broken header, or fewer pixels than it says
[[nodiscard]] Image decode_pgm(std::span<const std::uint8_t> bytes, const std::filesystem::path& path);

}  // namespace reliefbench
