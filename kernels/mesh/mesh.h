#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace reliefbench {

/// A triangle mesh as files and formulas have it: a corner names a position, a place on the map and, where there are
/// any, a normal. Corners run anticlockwise seen from outside.
struct RawMesh {
  struct Corner {
    std::uint32_t position = 0;
    std::uint32_t uv = 0;
    std::uint32_t normal = 0;  ///< means something only where `normals` has any
  };
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector2d> uvs;
  std::vector<Eigen::Vector3d> normals;  ///< of any length; none: they are made of the triangles' own
  std::vector<std::array<Corner, 3>> triangles;
};

/// What stands where on a mesh: linear between a triangle's vertices, so that of these only `position` and `uv` are
/// exact there.
struct MeshVertex {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;  ///< unit, outwards
  /// Across the normal, where u grows most: how far along a unit of length, the mapping scale. kLeastGradient at least.
  Eigen::Vector3d u_gradient;
  Eigen::Vector3d v_gradient;
  Eigen::Vector2d uv;
  Eigen::Vector3d curvature;  ///< fit_curvature() along both gradients
};
/// Where the map has no size, its directions still are.
inline constexpr double kLeastGradient = 1e-6;

struct Mesh {
  std::vector<MeshVertex> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< none of them without area
};

inline constexpr std::size_t kMostTriangles = 1U << 18U;

/// Normals, mapping scales and curvatures of a mesh. Positions that are equal are one, whatever their uv, so that
/// neither a normal nor a curvature stops at a seam of the map; at one by whole tiles no mapping scale does. Triangles
/// without area are left out. Where no triangle says otherwise, a normal is +z.
[[nodiscard]] Mesh finish(const RawMesh& raw);

/// The quadric z = -(a x^2 + b y^2 + c x y) that fits points best, along a frame's x and y and its normal z: (a, b, c).
/// On a sphere of radius R seen from outside a = b = 1/(2R), c = 0. What the points leave open is as small as can be
/// whichever way the frame is turned; fewer than three points are no neighbourhood: 0.
/// points: relative to the vertex, in its frame; where x and y are not across each other, so is not the quadric
/// source: [RTM] listing 5.8; the mixed term, without which axes that are not the surface's own give wrong ones, is
/// ours
[[nodiscard]] Eigen::Vector3d fit_curvature(const std::vector<Eigen::Vector3d>& points);

/// Moved and scaled: the middle of its box comes to `middle`, what lies farthest from there at `radius`. One of no size
/// is moved only.
[[nodiscard]] Mesh placed(const Mesh& mesh, const Eigen::Vector3d& middle, double radius);

/// The Utah teapot, z up: Newell's 32 bicubic patches, each with the whole map on it and 2 segments^2 triangles.
/// Blinn's flat form; the lid is as wide as the rim, so that nothing shows between them.
[[nodiscard]] RawMesh teapot(int segments);

/// A torus round the z axis: the ring's radius 3, the tube's 1. u runs round the ring, 4 tiles, v round the tube, 1.
[[nodiscard]] RawMesh torus(int ring_segments, int tube_segments);
inline constexpr double kTorusRing = 3;  ///< radius, that of the tube is 1
inline constexpr int kTorusTiles = 4;    ///< round the ring

}  // namespace reliefbench
