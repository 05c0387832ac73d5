#pragma once
#include <string>

#include "kernels/image/texture_image.h"

namespace reliefbench {

/// A DDS file with the header of Direct3D 10: one 2D texture with its mip levels, as it lies in memory.
/// image: 1, 2 or 4 channels
/// source: Microsoft, Programming Guide for DDS
[[nodiscard]] std::string encode_dds(const TextureImage& image);

}  // namespace reliefbench
