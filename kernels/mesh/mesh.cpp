#include "kernels/mesh/mesh.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

namespace reliefbench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kLeastNeighbours = 5;  ///< as many as a quadric's three numbers and the errors of two need

/// Which of the positions that are equal stands for them.
std::vector<std::uint32_t> welded(const std::vector<Vector3d>& positions) {
  std::map<std::array<double, 3>, std::uint32_t> first;
  std::vector<std::uint32_t> places;
  places.reserve(positions.size());
  for (const Vector3d& p : positions) {
    // 0 and -0 are one position.
    const std::array key{p.x() + 0.0, p.y() + 0.0, p.z() + 0.0};
    places.push_back(first.emplace(key, static_cast<std::uint32_t>(places.size())).first->second);
  }
  return places;
}

/// A triangle's own numbers; area 0: it has no others.
struct Flat {
  double area = 0;  ///< twice
  Vector3d normal = Vector3d::Zero();
  Vector3d u_gradient = Vector3d::Zero();
  Vector3d v_gradient = Vector3d::Zero();
};

Flat flat_of(const std::array<Vector3d, 3>& p, const std::array<Vector2d, 3>& uv) {
  Flat flat;
  const Vector3d e1 = p[1] - p[0];
  const Vector3d e2 = p[2] - p[0];
  const Vector3d across = e1.cross(e2);
  const double longest = std::max({e1.squaredNorm(), e2.squaredNorm(), (e2 - e1).squaredNorm()});
  // A sliver whose height is lost in the rounding of its length points nowhere.
  constexpr double kSliver = 1e-12;
  if (!(across.norm() > kSliver * longest)) return flat;
  flat.area = across.norm();
  flat.normal = across / flat.area;
  // Of a linear function with these differences along the edges.
  const auto gradient = [&](double d1, double d2) -> Vector3d {
    return (d1 * e2.cross(flat.normal) + d2 * flat.normal.cross(e1)) / flat.area;
  };
  const Vector2d d1 = uv[1] - uv[0];
  const Vector2d d2 = uv[2] - uv[0];
  flat.u_gradient = gradient(d1.x(), d2.x());
  flat.v_gradient = gradient(d1.y(), d2.y());
  return flat;
}

double angle_between(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

Vector3d across(const Vector3d& v, const Vector3d& normal) { return v - normal * normal.dot(v); }

Vector3d unit_or(const Vector3d& v, const Vector3d& otherwise) {
  const double length = v.stableNorm();
  if (length > 0 && std::isfinite(length)) return v / length;
  return otherwise;
}

/// Of the triangles round a position that have the same part of the map there, and the same way round.
struct Mapping {
  double weight = 0;
  Vector3d u_gradient = Vector3d::Zero();
  Vector3d v_gradient = Vector3d::Zero();
};
/// A position, its place in a tile, and whether the map lies there mirrored.
using MappedPlace = std::tuple<std::uint32_t, std::int64_t, std::int64_t, bool>;
MappedPlace mapped_place(std::uint32_t position, const Vector2d& uv, bool is_mirrored) {
  const auto in_tile = [](double x) {
    constexpr double kPlaces = 1 << 20;
    return static_cast<std::int64_t>(std::round((x - std::floor(x)) * kPlaces)) % static_cast<std::int64_t>(kPlaces);
  };
  return {position, in_tile(uv.x()), in_tile(uv.y()), is_mirrored};
}

/// A direction of the map: no shorter than kLeastGradient.
Vector3d direction_of(const Vector3d& gradient, const Vector3d& normal, const Vector3d& otherwise) {
  Vector3d level = across(gradient, normal);
  if (level.norm() >= kLeastGradient && level.allFinite()) return level;
  return otherwise * kLeastGradient;
}

/// Positions by the triangles' edges.
class Neighbours {
 public:
  void join(std::uint32_t a, std::uint32_t b) {
    near_[a].insert(b);
    near_[b].insert(a);
  }
  /// The ring round a position, and the next one where that is too few.
  [[nodiscard]] std::set<std::uint32_t> of(std::uint32_t position) const {
    std::set<std::uint32_t> found = near_.at(position);
    if (found.size() < kLeastNeighbours)
      for (const std::uint32_t neighbour : std::set<std::uint32_t>(found)) {
        const auto& next = near_.at(neighbour);
        found.insert(next.begin(), next.end());
      }
    found.erase(position);
    return found;
  }

 private:
  std::map<std::uint32_t, std::set<std::uint32_t>> near_;
};

}  // namespace

Vector3d fit_curvature(const std::vector<Vector3d>& points) {
  if (points.size() < 3) return Vector3d::Zero();
  double reach = 0;
  for (const Vector3d& p : points) reach = std::max(reach, p.head<2>().norm());
  if (reach == 0) return Vector3d::Zero();
  // With its factor the mixed term weighs in the norm as it does in the quadric's matrix, which no turn of the frame
  // changes. In units of the reach, so that the rank is found whatever the mesh's size.
  const double mixed = std::sqrt(2.0);
  Eigen::MatrixX3d squares(points.size(), 3);
  Eigen::VectorXd falls(points.size());
  Eigen::Index row = 0;
  for (const Vector3d& p : points) {
    const Vector3d q = p / reach;
    squares.row(row) << q.x() * q.x(), q.y() * q.y(), mixed * q.x() * q.y();
    falls(row++) = -q.z();
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixX3d> solver;
  solver.setThreshold(1e-6);
  const Vector3d found = solver.compute(squares).solve(falls);
  if (!found.allFinite()) return Vector3d::Zero();
  return Vector3d(found.x(), found.y(), mixed * found.z()) / reach;
}

Mesh finish(const RawMesh& raw) {
  const std::vector<std::uint32_t> place = welded(raw.positions);
  const bool has_normals = !raw.normals.empty();

  // Vertices are corners that agree in all they name, of triangles on which the map lies the same way round: where a
  // map is mirrored at a seam, gradients point both ways.
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, bool>, std::uint32_t> known;
  Mesh mesh;
  std::vector<std::uint32_t> place_of;  // a vertex
  std::vector<bool> is_mirrored;        // a vertex
  std::vector<Vector3d> normal_at(raw.positions.size(), Vector3d::Zero());
  std::map<MappedPlace, Mapping> mappings;
  Neighbours neighbours;
  for (const auto& corners : raw.triangles) {
    std::array<Vector3d, 3> p;
    std::array<Vector2d, 3> uv;
    for (std::size_t i = 0; i < 3; ++i) {
      p.at(i) = raw.positions.at(corners.at(i).position);
      uv.at(i) = raw.uvs.at(corners.at(i).uv);
    }
    const Flat flat = flat_of(p, uv);
    if (flat.area == 0) continue;
    const bool is_turned = flat.normal.dot(flat.u_gradient.cross(flat.v_gradient)) < 0;
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t i = 0; i < 3; ++i) {
      const RawMesh::Corner& corner = corners.at(i);
      const std::uint32_t position = place[corner.position];
      const auto [at, is_new] =
          known.try_emplace({position, corner.uv, has_normals ? corner.normal : 0, is_turned}, mesh.vertices.size());
      triangle.at(i) = at->second;
      if (is_new) {
        mesh.vertices.push_back({.position = p.at(i),
                                 .normal = has_normals ? raw.normals.at(corner.normal) : Vector3d::Zero(),
                                 .u_gradient = Vector3d::Zero(),
                                 .v_gradient = Vector3d::Zero(),
                                 .uv = uv.at(i),
                                 .curvature = Vector3d::Zero()});
        place_of.push_back(position);
        is_mirrored.push_back(is_turned);
      }
      // Weighed by the angle, so that it does not matter how a face was cut into triangles.
      const double angle = angle_between(p.at((i + 1) % 3) - p.at(i), p.at((i + 2) % 3) - p.at(i));
      Mapping& mapping = mappings[mapped_place(position, uv.at(i), is_turned)];
      mapping.weight += angle;
      mapping.u_gradient += angle * flat.u_gradient;
      mapping.v_gradient += angle * flat.v_gradient;
      normal_at[position] += angle * flat.normal;
      neighbours.join(position, place[corners.at((i + 1) % 3).position]);
    }
    mesh.triangles.push_back(triangle);
  }

  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    MeshVertex& vertex = mesh.vertices[i];
    const Vector3d smooth = unit_or(normal_at[place_of[i]], Vector3d::UnitZ());
    vertex.normal = unit_or(vertex.normal, smooth);
    const Mapping& mapping = mappings.at(mapped_place(place_of[i], vertex.uv, is_mirrored[i]));
    vertex.u_gradient =
        direction_of(mapping.u_gradient / mapping.weight, vertex.normal, vertex.normal.unitOrthogonal());
    const Vector3d along_u = vertex.u_gradient.normalized();
    vertex.v_gradient = direction_of(mapping.v_gradient / mapping.weight, vertex.normal, vertex.normal.cross(along_u));
    const Vector3d along_v = vertex.v_gradient.normalized();
    std::vector<Vector3d> points;
    for (const std::uint32_t neighbour : neighbours.of(place_of[i])) {
      const Vector3d to = raw.positions[neighbour] - vertex.position;
      points.emplace_back(to.dot(along_u), to.dot(along_v), to.dot(vertex.normal));
    }
    vertex.curvature = fit_curvature(points);
  }
  return mesh;
}

Mesh placed(const Mesh& mesh, const Vector3d& middle, double radius) {
  if (mesh.vertices.empty()) return mesh;
  Vector3d low = mesh.vertices.front().position;
  Vector3d high = low;
  for (const MeshVertex& vertex : mesh.vertices) {
    low = low.cwiseMin(vertex.position);
    high = high.cwiseMax(vertex.position);
  }
  const Vector3d from = 0.5 * (low + high);
  double reach = 0;
  for (const MeshVertex& vertex : mesh.vertices) reach = std::max(reach, (vertex.position - from).stableNorm());
  const double scale = reach > 0 ? radius / reach : 1;
  Mesh moved = mesh;
  for (MeshVertex& vertex : moved.vertices) {
    vertex.position = middle + scale * (vertex.position - from);
    vertex.u_gradient /= scale;
    vertex.v_gradient /= scale;
    vertex.curvature /= scale;
  }
  return moved;
}

}  // namespace reliefbench
