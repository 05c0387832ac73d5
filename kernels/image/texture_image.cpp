#include "kernels/image/texture_image.h"

#include <array>

namespace reliefbench {

int TexelLayout::bytes() const {
  switch (type) {
    case TexelType::unorm8:
      return channels;
    case TexelType::unorm16:
    case TexelType::float16:
      return 2 * channels;
    case TexelType::float32:
      return 4 * channels;
  }
  return 0;
}

std::string_view texel_type_id(TexelType type) {
  constexpr std::array<std::string_view, 4> kIds{"unorm8", "unorm16", "float16", "float32"};
  return kIds.at(static_cast<std::size_t>(type));
}

}  // namespace reliefbench
