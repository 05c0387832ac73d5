#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/judge/metric.h"
#include "kernels/judge/score_pixel.h"

namespace reliefbench {

/// Hits -> what each pixel's is worth, against the exact hit of the very same ray.
/// e_z = |t - t_enter|; e_xy = that times the ray's horizontal texels per t
/// pixels, reference: frame size; map_width, map_height: texels, for e_xy; non-finite t counts as missed with the
/// ray's whole travel as error
[[nodiscard]] PixelScores judge_pixels(std::span<const ScorePixel> pixels, std::span<const ReferenceHit> reference,
                                       int map_width, int map_height);

/// The same of one pixel whose ray passes, as it was found or in truth; none where there are two hits.
[[nodiscard]] std::optional<PixelScore> score_passed(const ScorePixel& pixel, const ReferenceHit& reference);
/// The same of one pixel whose hit is e_xy texels off.
[[nodiscard]] PixelScore score_pixel(const ScorePixel& pixel, const ReferenceHit& reference, double e_xy);

struct JudgedFrame {
  FrameScore score;  ///< without what compares pictures
  PixelScores pixels;
  RayMask mask;  ///< of `pixels`
};

/// The exact first hits of a score frame's rays; of a pixel without one {}, which no judgement looks at.
[[nodiscard]] std::vector<ReferenceHit> exact_hits(const ReferenceTracer& tracer, std::span<const ScorePixel> pixels);

/// Hits -> score, by judge_pixels(). Where no pixel has a ray every number is 0, and errors of hits are where no ray
/// that should meet something does.
/// is_solid: rays may pass through
[[nodiscard]] JudgedFrame judge(std::span<const ScorePixel> pixels, std::span<const ReferenceHit> reference,
                                int map_width, int map_height, bool is_solid = false);
/// Of pixels that were judged already. passing: whose metrics of rays that pass count, kOfSolid or kOfSilhouette; "":
/// none
[[nodiscard]] JudgedFrame judge(std::span<const ScorePixel> pixels, PixelScores scores, std::string_view passing);

/// Fills in the metrics of a feature of the scene. found, exact: its values; mask: of the same frame
void judge_feature(std::string_view feature, std::span<const float> found, std::span<const float> exact,
                   std::span<const PixelScore> mask, FrameScore& score);

/// Fills in the metrics that compare a shaded frame with the shaded reference. mask: of the same frame's pixels
void judge_pictures(const PicturePair& pictures, const RayMask& mask, FrameScore& score);

/// The metrics of a moving camera: each the mean of its values over the frames that have one.
class MotionJudge {
 public:
  void add(const FlickerFrame& before, const FlickerFrame& now);
  /// A metric without any value has none.
  void fill_in(FrameScore& score) const;

 private:
  struct Sum {
    double sum = 0;
    int count = 0;
  };
  std::array<Sum, kMetrics.size()> sums_{};
};

}  // namespace reliefbench
