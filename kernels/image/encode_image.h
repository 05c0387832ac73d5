#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
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
};

/// An image file in memory, alpha not multiplied in. Equal sources give equal bytes.
/// extension: "png" (unorm8 or unorm16) or "exr" (floats)
/// throws: Error(environment) if OpenImageIO cannot write it
[[nodiscard]] std::string encode_image(std::string_view extension, const ImageSource& source);

}  // namespace reliefbench
