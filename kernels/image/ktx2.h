#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "kernels/image/texture_image.h"

namespace reliefbench {

/// A texture and what is told about it.
struct Ktx2File {
  TextureImage image;
  std::map<std::string, std::string> metadata{};  ///< keys in order, as the file has them
};

/// A KTX 2.0 file: one 2D texture with its mip levels, linear transfer, no supercompression.
/// source: KTX File Format Specification 2.0, Khronos Data Format Specification 1.3
[[nodiscard]] std::string encode_ktx2(const Ktx2File& file);

/// What encode_ktx2 made, bit for bit. Reads 2D textures of 1, 2 or 4 channels of unorm8, unorm16, float16 or float32
/// alone.
/// name: for messages only
/// throws: Error(bad_input), one line: not KTX 2.0, cut short, another kind of texture, any number that does not fit
[[nodiscard]] Ktx2File decode_ktx2(std::span<const std::byte> bytes, std::string_view name);

void write_ktx2(const std::filesystem::path& path, const Ktx2File& file);  ///< throws: Error(bad_input): unwritable
[[nodiscard]] Ktx2File read_ktx2(const std::filesystem::path& path);       ///< throws: as decode_ktx2; unreadable

}  // namespace reliefbench
