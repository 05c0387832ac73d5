#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace reliefbench {

/// rgtc, eac, bc7, astc: blocks of 4 x 4 texels (kernels/maps/block_codec.h). A channel is 8 bytes of rgtc, which is
/// BC4 of one channel, BC5 of two, and decodes to 8 bits, and of eac, which is EAC R11, EAC RG11, and decodes to 11; up
/// to two channels are 16 bytes of bc7, which decodes to 8 bits, and of astc, which decodes to 16.
enum class TexelType { unorm8, unorm16, float16, float32, rgtc, eac, bc7, astc };
inline constexpr std::array kTexelTypes{TexelType::unorm8, TexelType::unorm16, TexelType::float16, TexelType::float32,
                                        TexelType::rgtc,   TexelType::eac,     TexelType::bc7,     TexelType::astc};
[[nodiscard]] constexpr bool is_float(TexelType type) {
  return type == TexelType::float16 || type == TexelType::float32;
}
[[nodiscard]] constexpr bool is_of_blocks(TexelType type) { return type >= TexelType::rgtc; }
/// A block has all channels.
[[nodiscard]] constexpr bool has_one_block(TexelType type) { return type == TexelType::bc7 || type == TexelType::astc; }
/// Of a unorm, or what blocks decode to: the code of 1.
[[nodiscard]] std::uint32_t greatest_code(TexelType type);

/// One texel of a texture: 1, 2 or 4 channels of one type.
struct TexelLayout {
  TexelType type = TexelType::unorm8;
  int channels = 4;
  [[nodiscard]] int bytes() const;  ///< of blocks: of a texel that is decoded
  bool operator==(const TexelLayout&) const = default;
};
[[nodiscard]] std::string_view texel_type_id(TexelType type);  ///< unorm8, ..., as above

/// Side of a mip level, as GL and Vulkan have it: halves are rounded down, and never under 1.
[[nodiscard]] constexpr int level_side(int side, int level) { return side >> level > 0 ? side >> level : 1; }

/// Of a level of that many texels.
[[nodiscard]] std::size_t level_bytes(const TexelLayout& layout, int width, int height);

/// A texture ready for upload: tightly packed rows of texels or blocks, mip levels one after the other (level_side).
struct TextureImage {
  int width = 0;
  int height = 0;
  TexelLayout layout{};
  int levels = 1;
  std::vector<std::byte> texels{};
};
/// Of all levels.
[[nodiscard]] std::size_t image_bytes(const TextureImage& image);

}  // namespace reliefbench
