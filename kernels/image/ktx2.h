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
/// throws: Error(bad_input): a layout that no map is stored in
[[nodiscard]] std::string encode_ktx2(const Ktx2File& file);

/// What encode_ktx2 made, texels bit for bit; the metadata of ASTC tells its swizzle beside. Reads 2D textures of
/// layouts that maps are stored in alone.
/// name: for messages only
/// throws: Error(bad_input), one line: not KTX 2.0, cut short, another kind of texture, any number that does not fit
[[nodiscard]] Ktx2File decode_ktx2(std::span<const std::byte> bytes, std::string_view name);

[[nodiscard]] Ktx2File read_ktx2(const std::filesystem::path& path);  ///< throws: as read_file() and decode_ktx2()

}  // namespace reliefbench
