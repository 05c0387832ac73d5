#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace reliefbench {

/// Longest side of a heightmap in texels: what current graphics devices take as a 2D texture.
inline constexpr int kMaxSide = 16384;

/// A decoded image, rows from the top. 8- and 16-bit codes become code/255 and code/65535, correctly rounded; floats
/// are as in the file. Colour is never multiplied by alpha on reading.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;  ///< names as in the file: R, G, B, A, Y, ...
  int alpha = -1;                     ///< index of the alpha channel; -1: none
  std::vector<float> pixels;          ///< height x width x channels, interleaved
};

/// Reads the first image of a file: PNG, TIFF, EXR, TGA, WebP, PGM and what else OpenImageIO knows.
/// throws: Error(bad_input), one line with the path: missing, not an image, truncated or corrupt (no partial images),
///         a side under 2 or over kMaxSide
[[nodiscard]] Image load_image(const std::filesystem::path& path);

/// A PNG in memory. rgba8: height x width x 4 bytes, alpha not multiplied in. Equal pixels give equal bytes.
[[nodiscard]] std::vector<std::uint8_t> encode_png(int width, int height, std::span<const std::uint8_t> rgba8);

/// Writes encode_png's bytes to `path` at once: readers see the old file or the new one, never a part.
/// throws: Error(bad_input) naming the path
void write_png(const std::filesystem::path& path, int width, int height, std::span<const std::uint8_t> rgba8);

}  // namespace reliefbench
