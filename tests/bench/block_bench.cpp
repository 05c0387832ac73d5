#include <benchmark/benchmark.h>

#include <array>
#include <cstddef>
#include <vector>

#include "kernels/maps/block_codec.h"
#include "kernels/maps/texel.h"
#include "tests/cone_test_maps.h"

namespace reliefbench {
namespace {

/// The blocks of a map's heights.
std::vector<BlockCodes> blocks_of(const Heightfield& heights, TexelType type) {
  std::vector<BlockCodes> blocks;
  blocks.reserve(heights.texels.size() / 16);
  for (int y = 0; y + 4 <= heights.height; y += 4)
    for (int x = 0; x + 4 <= heights.width; x += 4) {
      BlockCodes& codes = blocks.emplace_back();
      for (int i = 0; i < 16; ++i) {
        const int texel = (y + i / 4) * heights.width + x + i % 4;
        codes.at(static_cast<std::size_t>(i)) =
            static_cast<std::uint16_t>(nearest_code(heights.texels[static_cast<std::size_t>(texel)], type));
      }
    }
  return blocks;
}

/// Lines read encode/map_type_rounding; time is of one block of one channel.
void encode(benchmark::State& state, Heightfield (*make)(int, int), TexelType type, BlockRounding rounding) {
  const std::vector<BlockCodes> blocks = blocks_of(make(256, 256), type);
  const BlockCodec& codec = find_codec(type);
  std::size_t at = 0;
  while (state.KeepRunning()) {
    const AskedCodes asked{.codes = blocks[at], .rounding = rounding};
    std::array<std::uint8_t, 16> block{};
    codec.encode({&asked, 1}, block);
    benchmark::DoNotOptimize(block);
    at = (at + 1) % blocks.size();
  }
}

BENCHMARK_CAPTURE(encode, fbm_rgtc_nearest, fbm_map, TexelType::rgtc, BlockRounding::nearest)->MinTime(0.5);
BENCHMARK_CAPTURE(encode, fbm_eac_nearest, fbm_map, TexelType::eac, BlockRounding::nearest)->MinTime(0.5);
BENCHMARK_CAPTURE(encode, fbm_bc7_nearest, fbm_map, TexelType::bc7, BlockRounding::nearest)->MinTime(0.5);
BENCHMARK_CAPTURE(encode, fbm_astc_nearest, fbm_map, TexelType::astc, BlockRounding::nearest)->MinTime(0.5);
BENCHMARK_CAPTURE(encode, fbm_rgtc_below, fbm_map, TexelType::rgtc, BlockRounding::below)->MinTime(0.5);
BENCHMARK_CAPTURE(encode, fbm_eac_below, fbm_map, TexelType::eac, BlockRounding::below)->MinTime(0.5);
BENCHMARK_CAPTURE(encode, noise_rgtc_nearest, noise_map, TexelType::rgtc, BlockRounding::nearest)->MinTime(0.5);
BENCHMARK_CAPTURE(encode, noise_eac_nearest, noise_map, TexelType::eac, BlockRounding::nearest)->MinTime(0.5);
BENCHMARK_CAPTURE(encode, noise_bc7_nearest, noise_map, TexelType::bc7, BlockRounding::nearest)->MinTime(0.5);
BENCHMARK_CAPTURE(encode, noise_astc_nearest, noise_map, TexelType::astc, BlockRounding::nearest)->MinTime(0.5);

}  // namespace
}  // namespace reliefbench
