// Meshes from formulas.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "kernels/mesh/mesh.h"

namespace reliefbench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// M. Newell's teapot (1975) as its symmetry leaves it. A body of revolution's control points: radius, the way aside of
// the two middle ones of a quarter, height; pieces of a profile share their ends.
using Ring = std::array<double, 3>;
constexpr double kLidFit = 1.4 / 1.3;  ///< the lid's edge has the radius 1.3, the rim's inner one 1.4
constexpr std::array<Ring, 10> kBody{{{1.4, 0.784, 2.4},
                                      {1.3375, 0.749, 2.53125},
                                      {1.4375, 0.805, 2.53125},
                                      {1.5, 0.84, 2.4},
                                      {1.75, 0.98, 1.875},
                                      {2, 1.12, 1.35},
                                      {2, 1.12, 0.9},
                                      {2, 1.12, 0.45},
                                      {1.5, 0.84, 0.225},
                                      {1.5, 0.84, 0.15}}};
constexpr std::array<Ring, 4> kBottom{{{1.5, 0.84, 0.15}, {1.5, 0.84, 0.075}, {1.425, 0.798, 0}, {0, 0, 0}}};
constexpr std::array<Ring, 7> kLid{{{0, 0, 3.15},
                                    {0.8, 0.45, 3.15},
                                    {0, 0, 2.85},
                                    {0.2, 0.112, 2.7},
                                    {0.4, 0.224, 2.55},
                                    {1.3, 0.728, 2.55},
                                    {1.3, 0.728, 2.4}}};
/// Half a tube's control points: half its width, x and z on the one side, x and z on the other.
using Hoop = std::array<double, 5>;
constexpr std::array<Hoop, 7> kHandle{{{0.3, -1.6, 2.025, -1.5, 2.25},
                                       {0.3, -2.3, 2.025, -2.5, 2.25},
                                       {0.3, -2.7, 2.025, -3, 2.25},
                                       {0.3, -2.7, 1.8, -3, 1.8},
                                       {0.3, -2.7, 1.575, -3, 1.35},
                                       {0.3, -2.5, 1.125, -2.65, 0.9375},
                                       {0.3, -2, 0.9, -1.9, 0.6}}};
constexpr std::array<Hoop, 7> kSpout{{{0.66, 1.7, 1.425, 1.7, 0.6},
                                      {0.66, 2.6, 1.425, 3.1, 0.825},
                                      {0.25, 2.3, 2.1, 2.4, 2.025},
                                      {0.25, 2.7, 2.4, 3.3, 2.4},
                                      {0.25, 2.8, 2.475, 3.525, 2.49375},
                                      {0.15, 2.9, 2.475, 3.45, 2.5125},
                                      {0.15, 2.8, 2.4, 3.2, 2.4}}};

using ControlRow = std::array<Vector3d, 4>;
using Patch = std::array<ControlRow, 4>;

ControlRow row_of(const Ring& ring) {
  const auto [radius, aside, z] = ring;
  return {Vector3d(radius, 0, z), Vector3d(radius, -aside, z), Vector3d(aside, -radius, z), Vector3d(0, -radius, z)};
}
ControlRow row_of(const Hoop& hoop) {
  const auto [half, x0, z0, x1, z1] = hoop;
  return {Vector3d(x0, 0, z0), Vector3d(x0, -half, z0), Vector3d(x1, -half, z1), Vector3d(x1, 0, z1)};
}

/// Mirrored; columns run the other way then, so that a patch keeps its outside and u goes on beyond its edge.
Patch mirrored(const Patch& patch, const Vector3d& signs) {
  Patch image;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) image.at(i).at(j) = signs.cwiseProduct(patch.at(i).at(3 - j));
  return image;
}

/// On a cubic Bezier curve at i of n. Reversed it gives the same bits, so that patches share the points of an edge.
Vector3d on_curve(const ControlRow& p, int i, int n) {
  if (p[0] == p[1] && p[1] == p[2] && p[2] == p[3]) return p[0];  // a pole, whose weights' sum need not be 1
  const double t = static_cast<double>(i) / n;
  const double s = static_cast<double>(n - i) / n;
  return (p[0] * (s * s * s) + p[3] * (t * t * t)) + (p[1] * (3 * (s * s * t)) + p[2] * (3 * (s * t * t)));
}
Vector3d along_curve(const ControlRow& p, int i, int n) {
  const double t = static_cast<double>(i) / n;
  const double s = static_cast<double>(n - i) / n;
  return (p[1] - p[0]) * (s * s) + (p[2] - p[1]) * (2 * s * t) + (p[3] - p[2]) * (t * t);
}

/// A grid of points and normals with the uv of a map that lies tiles_u times across it.
class GridMesh {
 public:
  explicit GridMesh(RawMesh& mesh) : mesh_(mesh) {}

  template <typename PointAt>  // (row, column) -> position and normal
  void add(int rows, int columns, double tiles_u, const PointAt& point_at) {
    const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
    for (int i = 0; i <= rows; ++i)
      for (int j = 0; j <= columns; ++j) {
        const auto [position, normal] = point_at(i, j);
        mesh_.positions.push_back(position);
        mesh_.normals.push_back(normal);
        mesh_.uvs.emplace_back(tiles_u * j / columns, static_cast<double>(i) / rows);
      }
    const auto corner = [&](int i, int j) {
      const auto at = first + static_cast<std::uint32_t>(i * (columns + 1) + j);
      return RawMesh::Corner{.position = at, .uv = at, .normal = at};
    };
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) {
        mesh_.triangles.push_back({corner(i, j), corner(i, j + 1), corner(i + 1, j + 1)});
        mesh_.triangles.push_back({corner(i, j), corner(i + 1, j + 1), corner(i + 1, j)});
      }
  }

 private:
  RawMesh& mesh_;
};

/// A pole's row is one point, where the normal is that of the row next to it, in the limit.
Vector3d patch_normal(const Patch& patch, int i, int j, int n) {
  const auto normal_at = [&](int row, int column_at, int of) -> Vector3d {
    ControlRow down;  // v runs down the rows, u along them
    ControlRow at;
    for (std::size_t column = 0; column < 4; ++column) {
      const ControlRow curve{patch[0].at(column), patch[1].at(column), patch[2].at(column), patch[3].at(column)};
      down.at(column) = along_curve(curve, row, of);
      at.at(column) = on_curve(curve, row, of);
    }
    return along_curve(at, column_at, of).cross(on_curve(down, column_at, of));
  };
  Vector3d normal = normal_at(i, j, n);
  constexpr double kNothing = 1e-9;  // of sizes near 1
  if (normal.norm() > kNothing) return normal;
  constexpr int kNear = 1 << 12;
  return normal_at(i * kNear + (2 * i < n ? 1 : -1), j * kNear, n * kNear);
}

template <std::size_t kRows, typename Control>
void add_pieces(RawMesh& mesh, const std::array<Control, kRows>& control, bool is_round, int segments) {
  GridMesh grid(mesh);
  for (std::size_t first = 0; first + 3 < kRows; first += 3) {
    const Patch patch{row_of(control[first]), row_of(control[first + 1]), row_of(control[first + 2]),
                      row_of(control[first + 3])};
    std::vector<Patch> images{patch, mirrored(patch, {1, -1, 1})};
    if (is_round) {
      images.push_back(mirrored(patch, {-1, 1, 1}));
      images.push_back(mirrored(images[1], {-1, 1, 1}));
    }
    for (const Patch& image : images)
      grid.add(segments, segments, 1, [&](int i, int j) {
        ControlRow at;
        for (std::size_t column = 0; column < 4; ++column)
          at.at(column) = on_curve({image[0].at(column), image[1].at(column), image[2].at(column), image[3].at(column)},
                                   i, segments);
        return std::pair(on_curve(at, j, segments), patch_normal(image, i, j, segments));
      });
  }
}

}  // namespace

RawMesh teapot(int segments) {
  RawMesh mesh;
  std::array<Ring, kLid.size()> lid = kLid;
  for (Ring& ring : lid) {
    ring[0] *= kLidFit;
    ring[1] *= kLidFit;
  }
  lid.back() = kBody.front();  // to the bit
  add_pieces(mesh, kBody, true, segments);
  add_pieces(mesh, kBottom, true, segments);
  add_pieces(mesh, lid, true, segments);
  add_pieces(mesh, kHandle, false, segments);
  add_pieces(mesh, kSpout, false, segments);
  return mesh;
}

RawMesh torus(int ring_segments, int tube_segments) {
  RawMesh mesh;
  GridMesh(mesh).add(tube_segments, ring_segments, kTorusTiles, [&](int i, int j) {
    // The last point is the first to the bit.
    const double turn = 2 * std::numbers::pi * (j % ring_segments) / ring_segments;
    const double rise = 2 * std::numbers::pi * (i % tube_segments) / tube_segments;
    const Vector3d normal(std::cos(rise) * std::cos(turn), std::cos(rise) * std::sin(turn), std::sin(rise));
    return std::pair(Vector3d(Vector3d(std::cos(turn), std::sin(turn), 0) * kTorusRing + normal), normal);
  });
  return mesh;
}

}  // namespace reliefbench
