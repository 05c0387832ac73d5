#pragma once
#include <span>
#include <vector>

#include "kernels/heightfield.h"

namespace reliefbench {

/// A ray in texture space: p(t) = (u + slope_u t, v + slope_v t), height z(t) = 1 - t, t in [0, 1].
/// uv in tiles, slope in uv per unit of height. It enters at the top plate at t = 0 and leaves at the bottom, t = 1.
struct TextureRay {
  float u = 0;
  float v = 0;
  float slope_u = 0;
  float slope_v = 0;
};

/// The exact first solid interval along a ray.
struct ReferenceHit {
  double t_enter = 0;  ///< first t with z(t) <= surface; always exists in [0, 1] since heights are >= 0
  double t_exit = 0;   ///< end of that solid interval; +infinity where the ray stays inside to the bottom
};

/// Exact first hits of rays on the bilinear surface, in double precision, cell by cell. [FACTS 3]
/// Immutable after construction; trace() is safe from many threads.
class ReferenceTracer {
 public:
  ReferenceTracer(const Heightfield& heights, Wrap wrap);  ///< throws: Error if either side is under 2 texels
  [[nodiscard]] ReferenceHit trace(const TextureRay& ray) const;
  [[nodiscard]] std::vector<ReferenceHit> trace(std::span<const TextureRay> rays, int threads = 0) const;

  static constexpr int kVersion = 1;  ///< part of the cache key; raised when a result changes

 private:
  int width_;
  int height_;
  Wrap wrap_;
  // (the implementer adds what is needed)
};

}  // namespace reliefbench
