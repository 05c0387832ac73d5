#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace reliefbench {

/// Longest side of a heightmap in texels: what current graphics devices take as a 2D texture.
inline constexpr int kMaxSide = 16384;
/// Most channels of an image file.
inline constexpr int kMaxChannels = 256;
/// Most memory that a decoded image takes (4 bytes a channel and texel): kMaxSide squared with two channels.
inline constexpr std::int64_t kMaxDecodedBytes = std::int64_t{1} << 31;
/// Longest image file in bytes: the largest that is read, stored without compression with 8 bytes a channel.
inline constexpr std::int64_t kMaxFileBytes = 2 * kMaxDecodedBytes;

/// A decoded image, rows from the top. 8- and 16-bit codes become code/255 and code/65535, correctly rounded; signed
/// and 32-bit integers are multiplied by 1/greatest; floats are as in the file. Colour is never multiplied by alpha.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;  ///< names as in the file: R, G, B, A, Y, ...
  int alpha = -1;                     ///< index of the alpha channel; -1: none
  std::string sample;                 ///< what the file stores, for people: 8-bit | 16-bit | half-float | float | ...
  std::vector<float> pixels;          ///< height x width x channels, interleaved
};

/// Reads the first image of a file that is PNG, TIFF, OpenEXR, WebP or PNM (PGM, PPM) by its content, whatever it is
/// called, or TGA by its name, since only its second version has a signature. Nothing else is read.
/// throws: Error(bad_input), one line with the path: missing, no regular file, not an image, truncated or corrupt (no
///         partial images), a side under 2 or over kMaxSide, too many channels, too large
[[nodiscard]] Image load_image(const std::filesystem::path& path);

/// A PNG in memory, made quickly. rgba8: height x width x 4 bytes, alpha not multiplied in. Equal pixels give equal
/// bytes.
[[nodiscard]] std::vector<std::uint8_t> encode_png(int width, int height, std::span<const std::uint8_t> rgba8);

/// Writes encode_png's bytes to `path` at once: readers see the old file or the new one, never a part.
/// throws: Error(bad_input) naming the path; FileError, Error(environment): the disk is full, or has failed
void write_png(const std::filesystem::path& path, int width, int height, std::span<const std::uint8_t> rgba8);

/// A WebP in memory, for a page: a fifth of the PNG's bytes, and colours off by a few codes. Alpha is left out.
[[nodiscard]] std::vector<std::uint8_t> encode_webp(int width, int height, std::span<const std::uint8_t> rgba8);

}  // namespace reliefbench
