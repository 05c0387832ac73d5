#include "kernels/image/texture_image.h"

#include <array>
#include <cassert>

namespace reliefbench {

int TexelLayout::bytes() const {
  switch (type) {
    case TexelType::unorm8:
    case TexelType::rgtc:
    case TexelType::bc7:
      return channels;
    case TexelType::unorm16:
    case TexelType::float16:
    case TexelType::eac:
    case TexelType::astc:
      return 2 * channels;
    case TexelType::float32:
      return 4 * channels;
  }
  return 0;
}

std::uint32_t greatest_code(TexelType type) {
  switch (type) {
    case TexelType::unorm8:
    case TexelType::rgtc:
    case TexelType::bc7:
      return 255;
    case TexelType::eac:
      return 2047;
    case TexelType::unorm16:
    case TexelType::astc:
      return 65535;
    case TexelType::float16:
    case TexelType::float32:
      break;
  }
  assert(false);
  return 0;
}

std::size_t level_bytes(const TexelLayout& layout, int width, int height) {
  if (is_of_blocks(layout.type))
    return static_cast<std::size_t>(has_one_block(layout.type) && layout.channels > 0 ? 16 : 8 * layout.channels) *
           static_cast<std::size_t>((width + 3) / 4) * static_cast<std::size_t>((height + 3) / 4);
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(layout.bytes());
}

std::size_t image_bytes(const TextureImage& image) {
  std::size_t bytes = 0;
  for (int level = 0; level < image.levels; ++level)
    bytes += level_bytes(image.layout, level_side(image.width, level), level_side(image.height, level));
  return bytes;
}

std::string_view texel_type_id(TexelType type) {
  constexpr std::array<std::string_view, 8> kIds{"unorm8", "unorm16", "float16", "float32",
                                                 "rgtc",   "eac",     "bc7",     "astc"};
  return kIds.at(static_cast<std::size_t>(type));
}

}  // namespace reliefbench
