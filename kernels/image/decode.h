#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kernels/image/image.h"

namespace reliefbench {

/// A whole file in memory.
using FileBytes = std::span<const std::uint8_t>;

// One reader a format. Each checks the shape that the header claims (check_shape) before it takes memory for it, and
// takes that as the file's data come in, so that a header alone costs nothing.
// name: of the file, for messages only
// throws: Error(bad_input), one line that begins with the name: truncated, corrupt, or of a kind that is not read
[[nodiscard]] Image decode_png(FileBytes bytes, const std::string& name);
[[nodiscard]] Image decode_tiff(FileBytes bytes, const std::string& name);
[[nodiscard]] Image decode_exr(FileBytes bytes, const std::string& name);
[[nodiscard]] Image decode_webp(FileBytes bytes, const std::string& name);
[[nodiscard]] Image decode_tga(FileBytes bytes, const std::string& name);
[[nodiscard]] Image decode_netpbm(FileBytes bytes, const std::string& name);

/// throws: Error(bad_input): a side under 2 or over kMaxSide, no channel or over kMaxChannels, over kMaxDecodedBytes
void check_shape(std::int64_t width, std::int64_t height, std::int64_t channels, const std::string& name);

/// An image of a checked shape without pixels yet, but with memory set aside for them. Channels are called Y or R, G,
/// B, then "channel3", ...; the one that is alpha is called A. alpha: its index, -1: none; sample: Image::sample
[[nodiscard]] Image blank_image(int width, int height, int channels, int alpha, std::string sample);

/// Appends codes as code / the greatest of their type, correctly rounded.
template <typename Code>
void append_codes(std::vector<float>& pixels, std::span<const Code> codes) {
  constexpr auto kGreatest = static_cast<float>(static_cast<Code>(~Code{0}));
  for (const Code code : codes) pixels.push_back(static_cast<float>(code) / kGreatest);
}

}  // namespace reliefbench
