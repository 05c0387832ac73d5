#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <vector>

#include "kernels/judge/picture_metrics.h"

// FLIP and SSIM as plainly as they can be written: whole planes, in double, one thread. What the vectorised code is
// held to, and timed beside.
namespace reliefbench::slow {
/// A float picture of one channel, row-major.
struct Plane {
  int width = 0;
  int height = 0;
  std::vector<float> values;
  [[nodiscard]] float at(int x, int y) const {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
};

enum class Edge {
  replicate,  ///< aaa|abc|ccc
  mirror,     ///< cba|abc|cba
};

inline int inside(int i, int n, Edge edge) {
  if (edge == Edge::replicate) return std::clamp(i, 0, n - 1);
  const int period = 2 * n;
  const int j = ((i % period) + period) % period;
  return j < n ? j : period - 1 - j;
}

/// Correlation along one axis: every pixel of a line of `n`, read by at(i).
template <typename At, typename Store>
void filter_line(int n, const std::vector<double>& kernel, Edge edge, const At& at, const Store& store) {
  const int radius = static_cast<int>(kernel.size() / 2);
  for (int i = 0; i < n; ++i) {
    double sum = 0;
    int j = i - radius;
    for (const double weight : kernel) sum += weight * static_cast<double>(at(inside(j++, n, edge)));
    store(i, static_cast<float>(sum));
  }
}

inline Plane filtered(const Plane& plane, const std::vector<double>& along_x, const std::vector<double>& along_y,
                      Edge edge) {
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(plane.width) + static_cast<std::size_t>(x);
  };
  Plane rows = plane;
  for (int y = 0; y < plane.height; ++y) {
    filter_line(
        plane.width, along_x, edge, [&](int x) { return plane.at(x, y); },
        [&](int x, float value) { rows.values[index(x, y)] = value; });
  }
  Plane result = rows;
  for (int x = 0; x < plane.width; ++x) {
    filter_line(
        plane.height, along_y, edge, [&](int y) { return rows.at(x, y); },
        [&](int y, float value) { result.values[index(x, y)] = value; });
  }
  return result;
}

inline std::vector<double> gaussian(double sigma, int radius) {
  std::vector<double> kernel;
  for (int x = -radius; x <= radius; ++x) kernel.push_back(std::exp(-x * x / (2 * sigma * sigma)));
  return kernel;
}

using Vec3 = std::array<double, 3>;
using Planes = std::array<Plane, 3>;

// sRGB primaries, white D65.
constexpr std::array<Vec3, 3> kXyzOfRgb{Vec3{10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
                                        Vec3{2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
                                        Vec3{1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};
constexpr std::array<Vec3, 3> kRgbOfXyz{Vec3{3.241003275, -1.537398934, -0.498615861},
                                        Vec3{-0.969224334, 1.875930071, 0.041554224},
                                        Vec3{0.055639423, -0.204011202, 1.057148933}};
constexpr Vec3 kWhite{0.950428545, 1.0, 1.088900371};

constexpr double kDifferencePower = 0.7;  // of the HyAB distance
constexpr double kKneeAt = 0.4;           // share of the greatest distance
constexpr double kKneeValue = 0.95;
constexpr double kFeatureWidth = 0.041;  // sigma of the edge and point detectors, degrees
constexpr double kFeaturePower = 0.5;

inline Vec3 multiply(const std::array<Vec3, 3>& m, const Vec3& v) {
  Vec3 result{};
  for (std::size_t i = 0; i < 3; ++i) result[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return result;
}

inline double linear_of_srgb(std::uint8_t code) {
  const double value = code / 255.0;
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

inline Vec3 ycxcz_of_xyz(const Vec3& xyz) {
  const Vec3 n{xyz[0] / kWhite[0], xyz[1] / kWhite[1], xyz[2] / kWhite[2]};
  return {116 * n[1] - 16, 500 * (n[0] - n[1]), 200 * (n[1] - n[2])};
}

inline Vec3 xyz_of_ycxcz(const Vec3& v) {
  const double y = (v[0] + 16) / 116;
  return {(y + v[1] / 500) * kWhite[0], y * kWhite[1], (y - v[2] / 200) * kWhite[2]};
}

/// CIELAB with chroma scaled by lightness (Hunt effect).
inline Vec3 hunt_lab(const Vec3& xyz) {
  constexpr double kDelta = 6.0 / 29;
  const auto f = [](double t) {
    return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
  };
  const Vec3 n{f(xyz[0] / kWhite[0]), f(xyz[1] / kWhite[1]), f(xyz[2] / kWhite[2])};
  const double lightness = 116 * n[1] - 16;
  return {lightness, 0.01 * lightness * 500 * (n[0] - n[1]), 0.01 * lightness * 200 * (n[1] - n[2])};
}

inline double hyab(const Vec3& a, const Vec3& b) {
  return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

inline Planes ycxcz_planes(std::span<const std::uint8_t> rgba8, int width, int height) {
  static const std::array<double, 256> kLinear = [] {
    std::array<double, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = linear_of_srgb(static_cast<std::uint8_t>(i));
    return table;
  }();
  Planes planes;
  for (Plane& plane : planes) plane = {.width = width, .height = height, .values = {}};
  for (std::size_t i = 0; i + 3 < rgba8.size(); i += 4) {
    const Vec3 rgb{kLinear[rgba8[i]], kLinear[rgba8[i + 1]], kLinear[rgba8[i + 2]]};
    const Vec3 v = ycxcz_of_xyz(multiply(kXyzOfRgb, rgb));
    for (std::size_t c = 0; c < 3; ++c) planes[c].values.push_back(static_cast<float>(v[c]));
  }
  return planes;
}

/// What the eye filters out of one channel: the sum of two Gaussians a sqrt(pi/b) exp(-pi^2 x^2 / b), x in degrees.
struct Sensitivity {
  double a1, b1, a2, b2;
};
constexpr std::array<Sensitivity, 3> kSensitivity{Sensitivity{1, 0.0047, 0, 1e-5}, Sensitivity{1, 0.0053, 0, 1e-5},
                                                  Sensitivity{34.1, 0.04, 13.5, 0.025}};

inline Plane seen(const Plane& plane, const Sensitivity& eye, double pixels_per_degree) {
  constexpr double kPi = std::numbers::pi;
  constexpr double kWidest = 0.04;  // the greatest b: all channels have one radius
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(kWidest / (2 * kPi * kPi)) * pixels_per_degree));
  const auto part = [&](double b) { return gaussian(std::sqrt(b / 2) / kPi * pixels_per_degree, radius); };
  const auto total = [](const std::vector<double>& kernel) {
    return std::accumulate(kernel.begin(), kernel.end(), 0.0);
  };
  const std::vector<double> first = part(eye.b1);
  const std::vector<double> second = part(eye.b2);
  const double weight1 = eye.a1 * std::sqrt(kPi / eye.b1);
  const double weight2 = eye.a2 * std::sqrt(kPi / eye.b2);
  const double sum = weight1 * total(first) * total(first) + weight2 * total(second) * total(second);
  const auto scaled = [](std::vector<double> kernel, double factor) {
    for (double& value : kernel) value *= factor;
    return kernel;
  };
  Plane result = filtered(plane, scaled(first, weight1 / sum), first, Edge::replicate);
  if (eye.a2 == 0) return result;
  const Plane rest = filtered(plane, scaled(second, weight2 / sum), second, Edge::replicate);
  for (std::size_t i = 0; i < result.values.size(); ++i) result.values[i] += rest.values[i];
  return result;
}

/// Filtered as the eye does, then brought back into what a screen can show, as Hunt-adjusted CIELAB.
inline std::vector<Vec3> seen_lab(const Planes& planes, double pixels_per_degree) {
  Planes filtered_planes;
  for (std::size_t c = 0; c < 3; ++c) filtered_planes[c] = seen(planes[c], kSensitivity[c], pixels_per_degree);
  std::vector<Vec3> lab;
  lab.reserve(planes[0].values.size());
  for (std::size_t i = 0; i < planes[0].values.size(); ++i) {
    const Vec3 v{filtered_planes[0].values[i], filtered_planes[1].values[i], filtered_planes[2].values[i]};
    Vec3 rgb = multiply(kRgbOfXyz, xyz_of_ycxcz(v));
    for (double& channel : rgb) channel = std::clamp(channel, 0.0, 1.0);
    lab.push_back(hunt_lab(multiply(kXyzOfRgb, rgb)));
  }
  return lab;
}

/// Distances up to the knee take 95 % of the scale, the rest what is left.
inline double spread(double distance, double greatest) {
  const double knee = kKneeAt * greatest;
  if (distance < knee) return kKneeValue / knee * distance;
  return kKneeValue + (distance - knee) / (greatest - knee) * (1 - kKneeValue);
}

/// Scales the positive weights to a sum of 1 and the negative ones to -1, as the 2D kernel kernel(x) * across(y) has
/// it.
inline void balance(std::vector<double>& kernel, const std::vector<double>& across) {
  const double side = std::accumulate(across.begin(), across.end(), 0.0);
  double positive = 0;
  double negative = 0;
  for (const double value : kernel) (value > 0 ? positive : negative) += value;
  for (double& value : kernel) value /= side * std::abs(value > 0 ? positive : negative);
}

struct Features {
  Plane edges;   ///< magnitude of the first derivative
  Plane points;  ///< of the second
};

inline Features features(const Plane& y, double pixels_per_degree) {
  const double sigma = kFeatureWidth * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  const std::vector<double> bell = gaussian(sigma, radius);
  std::vector<double> first = bell;
  std::vector<double> second = bell;
  int x = -radius;
  for (std::size_t i = 0; i < bell.size(); ++i, ++x) {
    first[i] *= -x;
    second[i] *= x * x / (sigma * sigma) - 1;
  }
  balance(first, bell);
  balance(second, bell);
  Plane lightness = y;
  for (float& value : lightness.values) value = (value + 16) / 116;
  const auto magnitude = [&](const std::vector<double>& kernel) {
    Plane along_x = filtered(lightness, kernel, bell, Edge::replicate);
    const Plane along_y = filtered(lightness, bell, kernel, Edge::replicate);
    for (std::size_t i = 0; i < along_x.values.size(); ++i)
      along_x.values[i] = std::hypot(along_x.values[i], along_y.values[i]);
    return along_x;
  };
  return {.edges = magnitude(first), .points = magnitude(second)};
}

inline double greatest_distance() {
  const auto lab = [](const Vec3& rgb) { return hunt_lab(multiply(kXyzOfRgb, rgb)); };
  return std::pow(hyab(lab({0, 1, 0}), lab({0, 0, 1})), kDifferencePower);
}

inline std::vector<float> flip_map(const PicturePair& pictures, double pixels_per_degree) {
  const Planes reference = ycxcz_planes(pictures.reference, pictures.width, pictures.height);
  const Planes test = ycxcz_planes(pictures.test, pictures.width, pictures.height);
  const std::vector<Vec3> reference_lab = seen_lab(reference, pixels_per_degree);
  const std::vector<Vec3> test_lab = seen_lab(test, pixels_per_degree);
  const Features reference_features = features(reference[0], pixels_per_degree);
  const Features test_features = features(test[0], pixels_per_degree);
  const double greatest = greatest_distance();
  std::vector<float> map;
  map.reserve(reference_lab.size());
  for (std::size_t i = 0; i < reference_lab.size(); ++i) {
    const double color = spread(std::pow(hyab(reference_lab[i], test_lab[i]), kDifferencePower), greatest);
    const double edges = std::abs(double{reference_features.edges.values[i]} - test_features.edges.values[i]);
    const double points = std::abs(double{reference_features.points.values[i]} - test_features.points.values[i]);
    const double feature = std::pow(std::max(edges, points) / std::numbers::sqrt2, kFeaturePower);
    map.push_back(static_cast<float>(std::pow(color, 1 - feature)));
  }
  return map;
}

constexpr double kSigma = 1.5;
constexpr int kRadius = 5;
constexpr double kC1 = (0.01 * 255) * (0.01 * 255);
constexpr double kC2 = (0.03 * 255) * (0.03 * 255);

inline Plane luma(std::span<const std::uint8_t> rgba8, int width, int height) {
  Plane plane{.width = width, .height = height, .values = {}};
  for (std::size_t i = 0; i + 3 < rgba8.size(); i += 4)
    plane.values.push_back(static_cast<float>(0.299 * rgba8[i] + 0.587 * rgba8[i + 1] + 0.114 * rgba8[i + 2]));
  return plane;
}

inline Plane product(const Plane& a, const Plane& b) {
  Plane result = a;
  for (std::size_t i = 0; i < a.values.size(); ++i) result.values[i] = a.values[i] * b.values[i];
  return result;
}

inline std::vector<float> ssim_map(const PicturePair& pictures) {
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

}  // namespace reliefbench::slow
