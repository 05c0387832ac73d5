#pragma once
#include <cstddef>
#include <string_view>
#include <vector>

namespace reliefbench {

enum class TexelType { unorm8, unorm16, float16, float32 };

/// One texel of a texture: 1, 2 or 4 channels of one type.
struct TexelLayout {
  TexelType type = TexelType::unorm8;
  int channels = 4;
  [[nodiscard]] int bytes() const;
  bool operator==(const TexelLayout&) const = default;
};
[[nodiscard]] std::string_view texel_type_id(TexelType type);  ///< unorm8 | unorm16 | float16 | float32

/// Side of a mip level, as GL and Vulkan have it: halves are rounded down, and never under 1.
[[nodiscard]] constexpr int level_side(int side, int level) { return side >> level > 0 ? side >> level : 1; }

/// A texture ready for upload: tightly packed rows, mip levels one after the other (level_side).
struct TextureImage {
  int width = 0;
  int height = 0;
  TexelLayout layout{};
  int levels = 1;
  std::vector<std::byte> texels{};
};

}  // namespace reliefbench
