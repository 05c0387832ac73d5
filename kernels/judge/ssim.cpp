#include <numeric>

#include "kernels/judge/filter.h"
#include "kernels/judge/picture_metrics.h"

namespace reliefbench {
namespace {

constexpr double kSigma = 1.5;
constexpr int kRadius = 5;
constexpr double kC1 = (0.01 * 255) * (0.01 * 255);
constexpr double kC2 = (0.03 * 255) * (0.03 * 255);

Plane luma(std::span<const std::uint8_t> rgba8, int width, int height) {
  Plane plane{.width = width, .height = height, .values = {}};
  for (std::size_t i = 0; i + 3 < rgba8.size(); i += 4)
    plane.values.push_back(static_cast<float>(0.299 * rgba8[i] + 0.587 * rgba8[i + 1] + 0.114 * rgba8[i + 2]));
  return plane;
}

Plane product(const Plane& a, const Plane& b) {
  Plane result = a;
  for (std::size_t i = 0; i < a.values.size(); ++i) result.values[i] = a.values[i] * b.values[i];
  return result;
}

}  // namespace

std::vector<float> ssim_map(const PicturePair& pictures) {
  std::vector<double> kernel = gaussian(kSigma, kRadius);
  const double sum = std::accumulate(kernel.begin(), kernel.end(), 0.0);
  for (double& weight : kernel) weight /= sum;
  const auto mean = [&](const Plane& plane) { return filtered(plane, kernel, kernel, Edge::mirror); };

  const Plane a = luma(pictures.reference, pictures.width, pictures.height);
  const Plane b = luma(pictures.test, pictures.width, pictures.height);
  const Plane mean_a = mean(a);
  const Plane mean_b = mean(b);
  const Plane mean_aa = mean(product(a, a));
  const Plane mean_bb = mean(product(b, b));
  const Plane mean_ab = mean(product(a, b));
  std::vector<float> map;
  map.reserve(a.values.size());
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    const double ma = mean_a.values[i];
    const double mb = mean_b.values[i];
    const double variances = mean_aa.values[i] - ma * ma + mean_bb.values[i] - mb * mb;
    const double covariance = mean_ab.values[i] - ma * mb;
    map.push_back(static_cast<float>((2 * ma * mb + kC1) * (2 * covariance + kC2) /
                                     ((ma * ma + mb * mb + kC1) * (variances + kC2))));
  }
  return map;
}

}  // namespace reliefbench
