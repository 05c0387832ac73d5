#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/base/unfilled.h"
#include "kernels/judge/reference.h"

namespace reliefbench {

/// What a traced pixel says of itself; the numbers are the shaders' (common.glsl).
enum class PixelStatus { no_ray = 0, hit = 1, step_cap = 2, passed = 3 };  ///< passed: it met no relief, and shows none

/// One pixel of a score frame: the ray that was traced and the hit that was found. Layout = two RGBA32F targets.
struct ScorePixel {
  TextureRay ray;
  float t = 0;       ///< found hit, ray parameter
  float status = 0;  ///< PixelStatus
  float taps = 0;    ///< texture instructions used by the trace
  float steps = 0;   ///< iterations used, all loops
};
static_assert(sizeof(ScorePixel) == 32);
[[nodiscard]] std::vector<TextureRay> rays_of(std::span<const ScorePixel> pixels);
/// Whether rays_of(pixels) would be these, bit by bit.
[[nodiscard]] bool have_rays(std::span<const ScorePixel> pixels, std::span<const TextureRay> rays);

/// How a pixel ended, judged against the reference: missed before unconverged before inside.
enum class Verdict : std::uint8_t {
  no_ray,       ///< status no_ray, or a ray that is not finite
  good,         ///< none of the below
  missed,       ///< t >= t_exit: the first solid was stepped over (not where t is a float next to t_enter)
  inside,       ///< e_xy > 1/2 and in the first solid: a refinement would find the hit
  unconverged,  ///< e_xy > 1/2 and stopped before the surface, or inside but at the step cap
  passed,       ///< rightly: the ray meets nothing
  false_kill,   ///< it passed, but the exact ray hits
  false_keep,   ///< it hit, but the exact ray passes
};
inline constexpr std::size_t kVerdicts = 8;

struct PixelScore {
  float e_xy;  ///< texels, along the ray's horizontal travel
  float e_z;   ///< height
  Verdict verdict;
};
/// Of a frame: size of the frame, row-major.
using PixelScores = UnfilledVector<PixelScore>;

[[nodiscard]] constexpr bool is_judged(Verdict verdict) { return verdict != Verdict::no_ray; }
[[nodiscard]] inline bool is_judged(const PixelScore& score) { return is_judged(score.verdict); }
/// Whether there are two hits, a found one and an exact one, which can be compared.
[[nodiscard]] constexpr bool has_hits(Verdict verdict) { return is_judged(verdict) && verdict < Verdict::passed; }
[[nodiscard]] inline bool has_hits(const PixelScore& score) { return has_hits(score.verdict); }

/// Which pixels of a frame have a ray, one byte each: pictures are compared there.
struct RayMask {
  UnfilledVector<std::uint8_t> has_ray;  ///< 1, or 0
  std::int64_t count = 0;                ///< of ones
};

/// The pixels of a frame as they were traced and as they were judged; frame size, row-major.
struct JudgedPixels {
  std::span<const ScorePixel> traced;
  std::span<const PixelScore> scores;
};

}  // namespace reliefbench
