#pragma once
#include <span>
#include <vector>

#include "kernels/image/heightfield.h"

namespace reliefbench {

/// A level of a relief map: heights, and cone ratios as MapContent::ratios has them.
struct MipLevel {
  Heightfield heights;
  std::vector<float> ratios;
};

/// Which levels a map has under its base.
enum class Mips {
  none,
  conservative,  ///< a trace of a coarse level never passes the surface of a finer one
  mean,          ///< heights are means, as engines make them; ratios are still the least
};

/// The levels under a relief map, from half its size to 1 x 1 (level_side). Mips::conservative: at every point the
/// interpolated height is at least the finer level's, and the interpolated ratio at most. A coarse texel is the maximum
/// of the heights and the minimum of the ratios of all the finer texels that any point within its own reach, one texel
/// each way, is interpolated from. ratios: ratios_per_texel a texel, interleaved; 0 ratios a texel for heights alone
[[nodiscard]] std::vector<MipLevel> mip_chain(const Heightfield& heights, std::span<const float> ratios,
                                              int ratios_per_texel, Wrap wrap, Mips mips = Mips::conservative);

}  // namespace reliefbench
