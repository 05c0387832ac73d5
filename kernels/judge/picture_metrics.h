#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kernels/judge/score_pixel.h"

namespace reliefbench {

/// What LDR-FLIP compares of a picture, a value a pixel: Hunt-adjusted CIELAB as the eye sees it, and the magnitudes of
/// its edges and points. Made once for a reference that many pictures are held to.
struct FlipFeatures {
  double pixels_per_degree = 0;
  std::vector<float> lightness, a, b;
  std::vector<float> edges, points;
};

/// Two RGBA8 pictures of one size, row-major; alpha is ignored.
struct PicturePair {
  std::span<const std::uint8_t> reference;
  std::span<const std::uint8_t> test;
  int width;
  int height;
  const FlipFeatures* reference_features = nullptr;  ///< of `reference`, where they were made before
};

inline constexpr double kPixelsPerDegree = 67.02;  ///< of the eye: a 0.7 m wide 4K screen seen from 0.7 m

[[nodiscard]] FlipFeatures flip_features(std::span<const std::uint8_t> rgba8, int width, int height,
                                         double pixels_per_degree = kPixelsPerDegree);

/// LDR-FLIP of every pixel, 0 (no difference to be seen) to 1. Edges are replicated.
/// In float; within 1e-4 of the same in double (tests).
/// source: Andersson et al., FLIP: A Difference Evaluator for Alternating Images, 2020
[[nodiscard]] std::vector<float> flip_map(const PicturePair& pictures, double pixels_per_degree = kPixelsPerDegree);
/// Its mean over the pixels that have a ray; 0 where there is no such pixel.
[[nodiscard]] std::optional<double> flip_mean(const PicturePair& pictures, const RayMask& mask);

/// Structural similarity of every pixel's luma (Rec. 601), -1 to 1: Gaussian window of sigma 1.5, 11 x 11, K1 = 0.01,
/// K2 = 0.03, population covariance. Edges are mirrored. In float; within 1e-4 of the same in double (tests).
/// source: Wang et al., Image Quality Assessment: From Error Visibility to Structural Similarity, 2004
[[nodiscard]] std::vector<float> ssim_map(const PicturePair& pictures);
/// Its mean, likewise; 1 where there is no such pixel.
[[nodiscard]] std::optional<double> ssim_mean(const PicturePair& pictures, const RayMask& mask);

/// How the error of a moving picture trembles: mean |E - E_before| over pixels with a ray in both frames and over their
/// three channels, as a share of full scale. E = picture - reference, of this frame and of the one before.
struct FlickerFrame {
  std::span<const std::uint8_t> picture;    ///< RGBA8
  std::span<const std::uint8_t> reference;  ///< RGBA8
  std::span<const PixelScore> mask;
};
[[nodiscard]] std::optional<double> flicker(const FlickerFrame& before, const FlickerFrame& now);

}  // namespace reliefbench
