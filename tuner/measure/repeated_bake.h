#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "backends/gpu_bake.h"

namespace reliefbench {

/// Bakes on hardware that are timed, unless somebody says how many. One more comes first, of which no time is kept: it
/// wakes the device and is the first to run its shaders.
inline constexpr int kHardwareBakes = 5;

struct BakeTime {
  double wall_ns = 0;                ///< on the host's clock, without the way to another process and back
  std::vector<ComputeTime> parts{};  ///< likewise, on the device's own clock; none: it has none
};

struct RepeatedBake {
  std::vector<float> values{};  ///< of the last one, as GpuBake has them
  std::optional<MapTextures> textures{};
  std::vector<BakeTime> times{};  ///< one a bake
};
/// warms_up: bakes once more before
[[nodiscard]] RepeatedBake bake_repeatedly(const std::function<GpuBake()>& bake, int bakes, bool warms_up);

}  // namespace reliefbench
