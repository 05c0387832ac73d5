#pragma once
#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "kernels/image/texture_image.h"

namespace reliefbench {

/// What an image file is made from: height x width x channels texels, rows from the top.
struct ImageSource {
  int width = 0;
  int height = 0;
  TexelType type = TexelType::unorm8;
  std::vector<std::string> channels;
  std::span<const std::byte> pixels;
  std::map<std::string, std::string> metadata{};
  bool is_quick = false;  ///< of a PNG: a sixth of the time, for a file up to half as long again
};

// An image file in memory, alpha not multiplied in. Equal sources give equal bytes.
// throws: Error(environment) if the library cannot write it

/// type: unorm8 or unorm16; one to four channels, whose meaning their number says
[[nodiscard]] std::string encode_png(const ImageSource& source);
/// type: unorm8; one, three or four channels, not packed
[[nodiscard]] std::string encode_tga(const ImageSource& source);
/// type: float32
[[nodiscard]] std::string encode_exr(const ImageSource& source);

}  // namespace reliefbench
