#pragma once
#include <array>
#include <vector>

namespace reliefbench {

using FlipVec3 = std::array<double, 3>;

// sRGB primaries, white D65.
inline constexpr std::array<FlipVec3, 3> kXyzOfRgb{
    FlipVec3{10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    FlipVec3{2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    FlipVec3{1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};
inline constexpr std::array<FlipVec3, 3> kRgbOfXyz{FlipVec3{3.241003275, -1.537398934, -0.498615861},
                                                   FlipVec3{-0.969224334, 1.875930071, 0.041554224},
                                                   FlipVec3{0.055639423, -0.204011202, 1.057148933}};
inline constexpr FlipVec3 kWhite{0.950428545, 1.0, 1.088900371};

inline constexpr double kDifferencePower = 0.7;  // of the HyAB distance
inline constexpr double kKneeAt = 0.4;           // share of the greatest distance
inline constexpr double kKneeValue = 0.95;
inline constexpr double kFeatureWidth = 0.041;  // sigma of the edge and point detectors, degrees
inline constexpr double kLabDelta = 6.0 / 29;   // where CIELAB's root becomes a line

/// Everything that depends on the eye alone.
struct FlipEye {
  /// A kernel to be applied along x, then one along y.
  struct Separable {
    std::vector<float> along_x, along_y;
  };
  std::array<Separable, 3> channels;     ///< of Y, Cx and Cz: what the eye filters out
  Separable blue_rest;                   ///< a second part of Cz's
  std::vector<float> bell, edge, point;  ///< the detectors, applied to the lightness
  int radius = 0;                        ///< the greatest of all kernels'
  float greatest = 0;                    ///< distance that two colours can have
};

/// pixels_per_degree: of the eye that looks at the screen
[[nodiscard]] FlipEye flip_eye(double pixels_per_degree);

}  // namespace reliefbench
