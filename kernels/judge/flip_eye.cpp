#include "kernels/judge/flip_eye.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "kernels/judge/tiles.h"

namespace reliefbench {
namespace {

/// HyAB^0.7 between pure green and pure blue.
float greatest_distance() {
  const auto lab = [](const FlipVec3& rgb) {
    const auto xyz = [&](std::size_t i) {
      return kXyzOfRgb[i][0] * rgb[0] + kXyzOfRgb[i][1] * rgb[1] + kXyzOfRgb[i][2] * rgb[2];
    };
    const auto root = [](double t) {
      return t > kLabDelta * kLabDelta * kLabDelta ? std::cbrt(t) : t / (3 * kLabDelta * kLabDelta) + 4.0 / 29;
    };
    const FlipVec3 f{root(xyz(0) / kWhite[0]), root(xyz(1) / kWhite[1]), root(xyz(2) / kWhite[2])};
    const double lightness = 116 * f[1] - 16;
    return FlipVec3{lightness, 5 * lightness * (f[0] - f[1]), 2 * lightness * (f[1] - f[2])};
  };
  const FlipVec3 green = lab({0, 1, 0});
  const FlipVec3 blue = lab({0, 0, 1});
  return static_cast<float>(
      std::pow(std::abs(green[0] - blue[0]) + std::hypot(green[1] - blue[1], green[2] - blue[2]), kDifferencePower));
}

/// The contrast sensitivity of one channel: the sum of two Gaussians a sqrt(pi/b) exp(-pi^2 x^2 / b), x in degrees.
struct Sensitivity {
  double a1, b1, a2, b2;
};
constexpr std::array<Sensitivity, 3> kSensitivity{Sensitivity{1, 0.0047, 0, 1e-5}, Sensitivity{1, 0.0053, 0, 1e-5},
                                                  Sensitivity{34.1, 0.04, 13.5, 0.025}};

double total(const std::vector<double>& kernel) { return std::accumulate(kernel.begin(), kernel.end(), 0.0); }

/// A symmetric kernel times a factor, without the ends that a float does not see beside the middle.
std::vector<float> seen(const std::vector<double>& kernel, double factor) {
  const double least = kernel[kernel.size() / 2] * std::numeric_limits<float>::epsilon() / 2;
  const auto ends = std::ranges::find_if(kernel, [&](double weight) { return weight > least; }) - kernel.begin();
  return scaled({kernel.begin() + ends, kernel.end() - ends}, factor);
}

/// Scales the positive weights to a sum of 1 and the negative ones to -1, as the 2D kernel kernel(x) * across(y) has
/// it.
std::vector<float> balanced(const std::vector<double>& kernel, const std::vector<double>& across) {
  double positive = 0;
  double negative = 0;
  for (const double value : kernel) (value > 0 ? positive : negative) += value;
  std::vector<float> result;
  result.reserve(kernel.size());
  for (const double value : kernel)
    result.push_back(static_cast<float>(value / (total(across) * std::abs(value > 0 ? positive : negative))));
  return result;
}

}  // namespace

FlipEye flip_eye(double pixels_per_degree) {
  constexpr double kPi = std::numbers::pi;
  constexpr double kWidest = 0.04;  // the greatest b: all channels have one radius
  const int color_radius = static_cast<int>(std::ceil(3 * std::sqrt(kWidest / (2 * kPi * kPi)) * pixels_per_degree));
  const double sigma = kFeatureWidth * pixels_per_degree;
  const int feature_radius = static_cast<int>(std::ceil(3 * sigma));
  FlipEye eye;
  eye.radius = std::max(color_radius, feature_radius);
  eye.greatest = greatest_distance();

  for (std::size_t c = 0; c < 3; ++c) {
    const Sensitivity& channel = kSensitivity[c];
    const auto part = [&](double b) { return gaussian(std::sqrt(b / 2) / kPi * pixels_per_degree, color_radius); };
    const std::vector<double> first = part(channel.b1);
    const std::vector<double> second = part(channel.b2);
    const double weight1 = channel.a1 * std::sqrt(kPi / channel.b1);
    const double weight2 = channel.a2 * std::sqrt(kPi / channel.b2);
    const double sum = weight1 * total(first) * total(first) + weight2 * total(second) * total(second);
    eye.channels[c] = {.along_x = seen(first, weight1 / sum), .along_y = seen(first, 1)};
    if (channel.a2 != 0) eye.blue_rest = {.along_x = seen(second, weight2 / sum), .along_y = seen(second, 1)};
  }

  const std::vector<double> bell = gaussian(sigma, feature_radius);
  std::vector<double> first = bell;
  std::vector<double> second = bell;
  int x = -feature_radius;
  for (std::size_t i = 0; i < bell.size(); ++i, ++x) {
    first[i] *= -x;
    second[i] *= x * x / (sigma * sigma) - 1;
  }
  eye.bell = scaled(bell, 1);
  eye.edge = balanced(first, bell);
  eye.point = balanced(second, bell);
  return eye;
}

}  // namespace reliefbench
