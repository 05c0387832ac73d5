#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/judge/reference.h"

namespace reliefbench {

/// What a traced pixel says of itself; the numbers are the shaders' (common.glsl).
enum class PixelStatus { no_ray = 0, hit = 1, step_cap = 2 };

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

/// How a pixel ended, judged against the reference: missed before unconverged before inside.
enum class Verdict : std::uint8_t {
  no_ray,       ///< status no_ray, or a ray that is not finite
  good,         ///< none of the below
  missed,       ///< t >= t_exit: the first solid was stepped over (not where t is a float next to t_enter)
  inside,       ///< e_xy > 1/2 and in the first solid: a refinement would find the hit
  unconverged,  ///< e_xy > 1/2 and stopped before the surface, or inside but at the step cap
};

struct PixelScore {
  float e_xy = 0;  ///< texels, along the ray's horizontal travel
  float e_z = 0;   ///< height
  Verdict verdict = Verdict::no_ray;
};

/// Distribution of an error over the pixels that have a ray; percentiles by nearest rank, so each is a value that
/// occurred. All 0 where no pixel has a ray.
struct Distribution {
  double mean = 0, p50 = 0, p95 = 0, p99 = 0, max = 0;
};

struct FrameScore {
  std::int64_t pixels = 0;  ///< pixels with a ray
  Distribution e_xy;
  Distribution e_z;
  double missed_rate = 0;
  double inside_rate = 0;
  double unconverged_rate = 0;
  double mean_taps = 0;
  double max_taps = 0;
  std::optional<double> psnr;       ///< dB; none where the pictures are identical
  double flip = 0;                  ///< 0 to 1, mean
  double ssim = 1;                  ///< -1 to 1, mean
  std::optional<double> flicker{};  ///< share of full scale; none where no moving picture was drawn
};

struct JudgedFrame {
  FrameScore score;                ///< without what compares pictures
  std::vector<PixelScore> pixels;  ///< frame size, row-major
};

/// Judges a score frame against the reference of the very same rays.
/// e_z = |t - t_enter|; e_xy = that times the ray's horizontal texels per t
/// pixels, reference: frame size; map_width, map_height: texels, for e_xy; non-finite t counts as missed with the
/// ray's whole travel as error
[[nodiscard]] JudgedFrame judge_frame(std::span<const ScorePixel> pixels, std::span<const ReferenceHit> reference,
                                      int map_width, int map_height);

/// Peak signal-to-noise ratio of two RGBA8 pictures, alpha ignored, over the pixels where `mask` is not no_ray.
/// returns: dB; none where those pixels are equal
[[nodiscard]] std::optional<double> psnr_rgba8(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b,
                                               std::span<const PixelScore> mask);

/// A metric: id as used in budgets and reports. e.g. "e_xy.p99", "missed_rate", "psnr".
struct MetricRow {
  std::string_view id;
  std::string_view unit;
  bool lower_is_better;
  std::string_view description;
  std::optional<double> (*value)(const FrameScore&);  ///< none: not defined for this frame (psnr of equal pictures)
  bool compares_pictures = false;                     ///< shaded frames, not hits
  bool counts_work = false;                           ///< foretells the frame's time
};
[[nodiscard]] std::span<const MetricRow> metrics();
[[nodiscard]] const MetricRow& find_metric(std::string_view id);  ///< throws: Error(bad_input) listing the choices

}  // namespace reliefbench
