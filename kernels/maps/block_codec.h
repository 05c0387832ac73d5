#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/image/heightfield.h"
#include "kernels/image/texture_image.h"

namespace reliefbench {

// Textures of blocks (is_of_blocks) of 4 x 4 texels: a channel has 8 bytes, which choose one of 8 values for each, or
// all have 16 together.

/// Codes of a block, row by row, as greatest_code() has them.
using BlockCodes = std::array<std::uint16_t, 16>;
using BlockBytes = std::array<std::uint8_t, 8>;

/// Which codes a block may have beside the asked ones.
enum class BlockRounding { nearest, below, above };

/// What a channel of a block should have.
struct AskedCodes {
  BlockCodes codes{};
  BlockRounding rounding = BlockRounding::nearest;
};

/// How a type's blocks are made and read, one row.
struct BlockCodec {
  TexelType type;
  /// The block whose codes are nearest to the asked ones, on their side of them; of the first channel exactly those
  /// where a block has them.
  /// nearest: by the sum of squares. below, above: where every texel has a code on that side, by the sum of the
  /// quotients of (asked + 1) and (code + 1), or of their complements.
  void (*encode)(std::span<const AskedCodes> channels, std::span<std::uint8_t> block);
  /// The codes of a channel of any block that encode() makes; of BC4, BC5 and EAC also of others' making. Of what else
  /// it may find it makes zeros.
  BlockCodes (*decode)(std::span<const std::uint8_t> block, std::size_t channel);
};
[[nodiscard]] const BlockCodec& find_codec(TexelType type);

// BC4 and BC5: two endpoints of 8 bits, and 3 bits a texel for the endpoints and 6 values between them, or 4 between
// them, 0 and 1. What lies between the endpoints the specifications give as a quotient by 7 or 5, and devices differ in
// its rounding (decode_rgtc cuts off). So the blocks made here have endpoints that differ by a multiple of 7 or 5: all
// 8 values are whole codes of 8 bits, which decoders that divide exactly all show. llvmpipe 22.3 does not: it reads up
// to one code less, never more, so that ratios are still safe there, but heights are not the ones that cones were baked
// from. Blocks of endpoints of any difference it reads up to two codes off. Libraries choose their endpoints freely;
// and stb_dxt's blocks are farther off even where they are decoded exactly: 1.2 times on rocks, 1.6 times on four
// (rms). source: Khronos Data Format Specification 1.3, RGTC: RED_RGTC1 is BC4_UNORM, RG_RGTC2 is BC5_UNORM
[[nodiscard]] BlockBytes encode_rgtc(const BlockCodes& codes, BlockRounding rounding);
[[nodiscard]] BlockCodes decode_rgtc(const BlockBytes& block);

// EAC R11 and RG11: a base of 8 bits, and 3 bits a texel for 8 modifiers, one of 16 sets times one of 16 factors. All
// arithmetic is of whole numbers, and a decoder may not cut off any of their 11 bits: every device has the same codes.
// What it makes of a code it may choose: code / 2047 is exact, but it may repeat the bits to any number. To 16, as Mesa
// does where it decodes for a device that cannot, that is (code << 5 | code >> 6) / 65535, up to kEacSpread off either
// way, 0.03 codes; more bits are less off. Ratios allow for that (value_spread), not for what has fewer than 16.
// source: Khronos Data Format Specification 1.3, Unsigned R11 EAC
inline constexpr float kEacSpread = 1.46e-5F;
[[nodiscard]] BlockBytes encode_eac(const BlockCodes& codes, BlockRounding rounding);
[[nodiscard]] BlockCodes decode_eac(const BlockBytes& block);

// BC7: red and green, of modes 4 to 6 (kernels/maps/pair_block.h). Mode 6 has 16 places between endpoints of 7 bits for
// both channels together; modes 4 and 5 have 4 or 8 for each channel, its own. All arithmetic is of whole numbers of 8
// bits, the same on every device. Encodings whose greatest code is a closed cone (Encoding::is_decreasing) do not go
// with it: the last bits of mode 6 are 0 here, so that ratios may be 0 and none is 255.
// source: Khronos Data Format Specification 1.3, BPTC: RGBA_BPTC_UNORM is BC7_UNORM
void encode_bc7(std::span<const AskedCodes> channels, std::span<std::uint8_t> block);
[[nodiscard]] BlockCodes decode_bc7(std::span<const std::uint8_t> block, std::size_t channel);

// ASTC of 4 x 4 texels: luminance and alpha, which views show as red and green. 32 places between
// endpoints of 192 values for both channels together, or 5 between those of 256 for each channel, its own. Decoded to
// binary16, as the specification has it unless an application asks for less, all devices have the same codes: 16 bits,
// of which those after the first 11 are 0. A value is code / 65536, up to kAstcSpread off from code / 65535. Decoded to
// 8 bits, as Mesa does for a device that cannot, values are up to a 255th off either way, which no margin makes up for.
// source: Khronos Data Format Specification 1.3, ASTC
inline constexpr float kAstcSpread = 1.53e-5F;
void encode_astc(std::span<const AskedCodes> channels, std::span<std::uint8_t> block);
[[nodiscard]] BlockCodes decode_astc(std::span<const std::uint8_t> block, std::size_t channel);

/// Codes of whole texels, TexelLayout::bytes() each, all levels, as blocks of their type. A block that reaches over the
/// image's edge has the nearest texels there.
/// first, second: how the channels are rounded
[[nodiscard]] TextureImage as_blocks(const TextureImage& codes, BlockRounding first, BlockRounding second);
/// A channel of a level of such an image, in [0, 1].
[[nodiscard]] std::vector<float> read_blocks(const TextureImage& image, int channel, int level);
/// Heights as blocks of the type will have them; as_blocks() keeps them as they then are.
[[nodiscard]] Heightfield heights_in_blocks(const Heightfield& heights, TexelType type, BlockRounding rounding);

}  // namespace reliefbench
