#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "kernels/image/heightfield.h"
#include "kernels/image/texture_image.h"

namespace reliefbench {

// Textures of blocks (TexelType::rgtc): BC4 and BC5. 4 x 4 values of a channel are 8 bytes: two endpoints of 8 bits,
// and for each texel 3 bits that choose one of 8 values: the endpoints and 6 between them, or 4 between them, 0 and 1.
// What lies between the endpoints the specifications give as a quotient by 7 or 5, and devices differ in its rounding.
// So the blocks made here have endpoints that differ by a multiple of 7 or 5: all 8 values are whole codes of 8 bits,
// which decoders that divide exactly all show. llvmpipe 22.3 does not: it reads up to one code less, never more, so
// that ratios are still safe there, but heights are not the ones that cones were baked from. Blocks of endpoints of any
// difference it reads up to two codes off. Libraries choose their endpoints freely; and stb_dxt's blocks are farther
// off even where they are decoded exactly: 2.67 codes rms on rocks where these are 2.24, 1.21 on four where these are
// 0.75. source: Khronos Data Format Specification 1.3, RGTC: RED_RGTC1 is BC4_UNORM, RG_RGTC2 is BC5_UNORM

/// Codes of 8 bits of a block, row by row.
using BlockCodes = std::array<std::uint8_t, 16>;
using BlockBytes = std::array<std::uint8_t, 8>;

/// Which codes a block may have beside the asked ones.
enum class BlockRounding { nearest, below, above };

/// The block whose codes are nearest to the asked ones, on their side of them; exactly those where a block has them.
/// nearest: by the sum of squares. below, above: where every texel has a code on that side, by the sum of the quotients
/// of (asked + 1) and (code + 1), or of their complements.
[[nodiscard]] BlockBytes encode_block(const BlockCodes& codes, BlockRounding rounding);
/// The codes of any block, also of others' making: quotients cut off.
[[nodiscard]] BlockCodes decode_block(const BlockBytes& block);

/// An image of unorm8, of one channel or two, as BC4 or BC5, all its levels. A block that reaches over the image's edge
/// has the nearest texels there.
/// second: how the second channel is rounded; the first one is to the nearest
[[nodiscard]] TextureImage as_blocks(const TextureImage& image, BlockRounding second);
/// A channel of a level of such an image, in [0, 1].
[[nodiscard]] std::vector<float> read_blocks(const TextureImage& image, int channel, int level);
/// Heights as blocks will have them; as_blocks() keeps them as they then are.
[[nodiscard]] Heightfield heights_in_blocks(const Heightfield& heights, BlockRounding rounding);

}  // namespace reliefbench
