// Triangle meshes: what their vertices say, OBJ files, the teapot.
#include "kernels/mesh/mesh.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <sstream>

#include "kernels/base/error.h"
#include "kernels/mesh/obj.h"

namespace reliefbench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

/// A grid of points z(x, y) = -(a x^2 + b y^2 + c x y) with uv = scale (x, y), without normals.
RawMesh sheet(const Vector3d& abc, double spacing, int side, double scale = 1) {
  RawMesh raw;
  for (int j = 0; j <= side; ++j)
    for (int i = 0; i <= side; ++i) {
      const double x = (i - side / 2) * spacing;
      const double y = (j - side / 2) * spacing;
      raw.positions.emplace_back(x, y, -(abc.x() * x * x + abc.y() * y * y + abc.z() * x * y));
      raw.uvs.emplace_back(scale * x, scale * y);
    }
  const auto at = [&](int i, int j) {
    const auto index = static_cast<std::uint32_t>(j * (side + 1) + i);
    return RawMesh::Corner{.position = index, .uv = index};
  };
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      raw.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      raw.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return raw;
}

RawMesh turned(RawMesh raw, const Eigen::Matrix3d& turn) {
  for (Vector3d& p : raw.positions) p = turn * p;
  for (Vector3d& n : raw.normals) n = turn * n;
  return raw;
}

Eigen::Matrix3d some_turn() {
  return Eigen::AngleAxisd(1.1, Vector3d(0.3, -0.8, 0.52).normalized()).toRotationMatrix();
}

/// A sphere's part round its equator as longitude and latitude, radius R, with its own normals.
RawMesh sphere(double radius, int segments) {
  RawMesh raw;
  for (int j = 0; j <= segments; ++j)
    for (int i = 0; i <= 2 * segments; ++i) {
      const double turn = std::numbers::pi * i / segments;
      const double rise = std::numbers::pi * (0.8 * j / segments - 0.4);
      const Vector3d n(std::cos(rise) * std::cos(turn), std::cos(rise) * std::sin(turn), std::sin(rise));
      raw.positions.emplace_back(radius * n);
      raw.normals.push_back(n);
      raw.uvs.emplace_back(2.0 * i / segments, 1.0 * j / segments);
    }
  const auto at = [&](int i, int j) {
    const auto index = static_cast<std::uint32_t>(j * (2 * segments + 1) + i);
    return RawMesh::Corner{.position = index, .uv = index, .normal = index};
  };
  for (int j = 0; j < segments; ++j)
    for (int i = 0; i < 2 * segments; ++i) {
      raw.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      raw.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return raw;
}

/// Of the quadric, a unit of length away in a direction across the normal.
double fall_along(const MeshVertex& v, const Vector3d& direction) {
  const double x = direction.dot(v.u_gradient.normalized());
  const double y = direction.dot(v.v_gradient.normalized());
  return v.curvature.dot(Vector3d(x * x, y * y, x * y));
}

TEST(FitCurvature, finds_a_quadric_and_its_mixed_term) {
  const Vector3d abc(0.7, -0.2, 0.4);
  std::vector<Vector3d> points;
  for (const auto& [x, y] : {std::pair(1.0, 0.1), {-0.4, 0.9}, {0.3, -0.8}, {-0.7, -0.6}})
    points.emplace_back(x, y, -(abc.x() * x * x + abc.y() * y * y + abc.z() * x * y));
  EXPECT_LT((fit_curvature(points) - abc).norm(), 1e-12);
  // 1e-6 and 1e6 times as large.
  for (const double scale : {1e-6, 1e6}) {
    std::vector<Vector3d> scaled = points;
    for (Vector3d& p : scaled) p *= scale;
    EXPECT_LT((fit_curvature(scaled) * scale - abc).norm(), 1e-9) << scale;
  }
}

TEST(FitCurvature, defines_what_points_leave_open) {
  const Vector3d none = Vector3d::Zero();
  EXPECT_EQ(fit_curvature({}), none);
  EXPECT_EQ(fit_curvature({{1, 0, -1}, {0, 1, -1}}), none);           // fewer than three
  EXPECT_EQ(fit_curvature({{0, 0, 1}, {0, 0, 2}, {0, 0, 3}}), none);  // none of them aside
  // A cross says nothing of the mixed term: it is as small as can be.
  EXPECT_LT((fit_curvature({{1, 0, -2}, {-1, 0, -2}, {0, 1, -3}, {0, -1, -3}}) - Vector3d(2, 3, 0)).norm(), 1e-12);
  // A line that is turned gives the same quadric, turned: of trace 1 and that direction alone.
  for (const double angle : {0.0, 0.3, 0.785398163397448, 1.4}) {
    const double x = std::cos(angle);
    const double y = std::sin(angle);
    const Vector3d found = fit_curvature({{x, y, -1}, {-x, -y, -1}, {2 * x, 2 * y, -4}});
    EXPECT_LT((found - Vector3d(x * x, y * y, 2 * x * y)).norm(), 1e-9) << angle;
  }
}

TEST(MeshCurvature, is_that_of_sphere_cylinder_and_plane_whichever_way_they_are_turned) {
  const double radius = 2.5;
  for (const bool is_turned : {false, true}) {
    const Eigen::Matrix3d turn = is_turned ? some_turn() : Eigen::Matrix3d::Identity();
    for (const MeshVertex& v : finish(turned(sphere(radius, 48), turn)).vertices)
      for (const double angle : {0.0, 0.7, 1.5, 2.2}) {
        const Vector3d across = v.normal.unitOrthogonal();
        const Vector3d direction = across * std::cos(angle) + v.normal.cross(across) * std::sin(angle);
        ASSERT_NEAR(fall_along(v, direction), 1 / (2 * radius), 0.01 / radius);
      }
    for (const MeshVertex& v : finish(turned(sheet({0, 0, 0}, 0.1, 8), turn)).vertices)
      EXPECT_LT(v.curvature.norm(), 1e-9);
  }
  // A cylinder along y; its edges are boundaries.
  RawMesh cylinder = sheet({0, 0, 0}, 0.05, 16);
  for (Vector3d& p : cylinder.positions) {
    const double turn = p.x() / radius;
    cylinder.normals.emplace_back(std::sin(turn), 0, std::cos(turn));
    p = Vector3d(radius * std::sin(turn), p.y(), radius * std::cos(turn));
  }
  for (auto& triangle : cylinder.triangles)
    for (RawMesh::Corner& corner : triangle) corner.normal = corner.position;
  for (const MeshVertex& v : finish(cylinder).vertices) {
    EXPECT_NEAR(v.curvature.x(), 1 / (2 * radius), 0.01 / radius);
    EXPECT_NEAR(v.curvature.y(), 0, 0.01 / radius);
  }
}

TEST(MeshCurvature, is_that_of_a_torus_outside_and_inside) {
  double worst = 0;
  for (const MeshVertex& v : finish(torus(128, 48)).vertices) {
    // u runs round the ring, where the normal section's radius is the distance from the axis over the normal's part
    // away from it; v round the tube.
    const double axial = v.position.head<2>().norm();
    const double away = v.normal.head<2>().dot(v.position.head<2>()) / axial;
    worst = std::max(worst, (v.curvature - Vector3d(away / axial / 2, 0.5, 0)).norm());
  }
  EXPECT_LT(worst, 0.01);
}

TEST(MeshCurvature, does_not_stop_at_a_seam) {
  // On a seam a position has two vertices; both have the curvature of what lies on either side.
  const Mesh mesh = finish(torus(64, 24));
  std::map<std::array<double, 3>, std::vector<Vector3d>> by_place;
  for (const MeshVertex& v : mesh.vertices)
    by_place[{v.position.x(), v.position.y(), v.position.z()}].push_back(v.curvature);
  EXPECT_EQ(by_place.size(), 64U * 24U);
  for (const auto& [place, curvatures] : by_place)
    for (const Vector3d& curvature : curvatures) ASSERT_LT((curvature - curvatures.front()).norm(), 1e-6);
}

TEST(MeshVertices, have_frames_and_mapping_scales) {
  for (const MeshVertex& v : finish(turned(sheet({0, 0, 0}, 0.25, 4, 3), some_turn())).vertices) {
    EXPECT_NEAR((v.u_gradient - 3 * some_turn().col(0)).norm(), 0, 1e-12);
    EXPECT_NEAR((v.v_gradient - 3 * some_turn().col(1)).norm(), 0, 1e-12);
  }
  // A map that is sheared: u grows along x - y / 2, and along x alone v does not grow.
  RawMesh sheared = sheet({0, 0, 0}, 0.25, 4);
  for (std::size_t i = 0; i < sheared.uvs.size(); ++i)
    sheared.uvs[i] = {sheared.positions[i].x() - 0.5 * sheared.positions[i].y(), sheared.positions[i].y()};
  for (const MeshVertex& v : finish(sheared).vertices) {
    EXPECT_LT((v.u_gradient - Vector3d(1, -0.5, 0)).norm(), 1e-12);
    EXPECT_LT((v.v_gradient - Vector3d(0, 1, 0)).norm(), 1e-12);
  }
}

TEST(MeshVertices, at_the_seam_of_a_mirrored_map_keep_both_gradients) {
  RawMesh raw = sheet(Vector3d::Zero(), 0.25, 8);
  for (Vector2d& uv : raw.uvs) uv.x() = std::abs(uv.x());
  int seam = 0;
  for (const MeshVertex& vertex : finish(raw).vertices) {
    EXPECT_NEAR(vertex.u_gradient.norm(), 1, 1e-9) << vertex.position.transpose();
    seam += vertex.position.x() == 0 ? 1 : 0;
  }
  EXPECT_EQ(seam, 2 * 9) << "one for each side";
}

TEST(MeshVertices, of_degenerate_meshes_are_defined) {
  // A map of no size, and one that is mirrored.
  for (const MeshVertex& v : finish(sheet({0, 0, 0}, 0.25, 4, 0)).vertices) {
    EXPECT_NEAR(v.u_gradient.norm(), kLeastGradient, 1e-12);
    EXPECT_NEAR(v.v_gradient.norm(), kLeastGradient, 1e-12);
    EXPECT_NEAR(v.u_gradient.dot(v.normal), 0, 1e-12);
  }
  // Collapsed triangles go; what they alone named goes with them.
  RawMesh raw = sheet({0, 0, 0}, 1, 1);
  raw.positions.emplace_back(5, 5, 5);
  raw.triangles.push_back({RawMesh::Corner{0, 0, 0}, {1, 1, 0}, {1, 1, 0}});
  raw.triangles.push_back({RawMesh::Corner{4, 0, 0}, {4, 1, 0}, {4, 2, 0}});
  const Mesh mesh = finish(raw);
  EXPECT_EQ(mesh.triangles.size(), 2U);
  EXPECT_EQ(mesh.vertices.size(), 4U);
  EXPECT_TRUE(finish(RawMesh{}).triangles.empty());
  EXPECT_TRUE(placed(Mesh{}, Vector3d::Zero(), 1).vertices.empty());
  // A lone triangle: two neighbours are no neighbourhood.
  raw.triangles.resize(1);
  for (const MeshVertex& v : finish(raw).vertices) EXPECT_EQ(v.curvature, Vector3d::Zero());
}

TEST(MeshPlaced, scales_lengths_and_what_goes_by_them) {
  const Mesh mesh = placed(finish(sphere(2.5, 24)), {0.5, 0.5, 0}, 0.25);
  double reach = 0;
  for (const MeshVertex& v : mesh.vertices) {
    reach = std::max(reach, (v.position - Vector3d(0.5, 0.5, 0)).norm());
    EXPECT_NEAR(v.curvature.x(), 2, 0.1);
  }
  EXPECT_NEAR(reach, 0.25, 1e-12);
}

/// Edges that no two triangles have, each one way, by position.
std::size_t open_edges(const Mesh& mesh) {
  using Place = std::array<double, 3>;
  std::map<std::pair<Place, Place>, int> edges;
  const auto place = [&](std::uint32_t vertex) {
    const Vector3d& p = mesh.vertices[vertex].position;
    return Place{p.x() + 0.0, p.y() + 0.0, p.z() + 0.0};
  };
  for (const auto& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const Place a = place(triangle.at(i));
      const Place b = place(triangle.at((i + 1) % 3));
      ++edges[{a, b}];
      --edges[{b, a}];
    }
  return static_cast<std::size_t>(std::ranges::count_if(edges, [](const auto& edge) { return edge.second > 0; }));
}

double volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    sum += mesh.vertices[a].position.dot(mesh.vertices[b].position.cross(mesh.vertices[c].position)) / 6;
  return sum;
}

TEST(Shapes, torus_is_closed_and_has_its_volume) {
  const Mesh mesh = finish(torus(96, 48));
  EXPECT_EQ(open_edges(mesh), 0U);
  const double exact = 2 * std::numbers::pi * std::numbers::pi * kTorusRing;
  EXPECT_NEAR(volume(mesh) / exact, 1, 0.01);
}

TEST(Shapes, teapot_is_newells) {
  for (const int segments : {2, 3, 8}) {
    const Mesh mesh = finish(teapot(segments));
    // 32 patches; of two rows of patches, at the lid's knob and in the middle of the bottom, one edge is a point.
    EXPECT_EQ(mesh.triangles.size(), static_cast<std::size_t>(32 * 2 * segments * segments - 8 * segments));
    for (const MeshVertex& v : mesh.vertices) {
      ASSERT_NEAR(v.normal.norm(), 1, 1e-9);
      EXPECT_TRUE(v.curvature.allFinite());
      EXPECT_TRUE(v.u_gradient.allFinite() && v.v_gradient.allFinite());
    }
    // Patches meet in the same points: what is open are the two ends of handle and spout, two half rings each, and the
    // slit between lid and rim, from both sides.
    EXPECT_EQ(open_edges(mesh), static_cast<std::size_t>(2 * (2 + 2) * segments)) << segments;
  }
  const Mesh mesh = finish(teapot(16));
  Vector3d low = mesh.vertices.front().position;
  Vector3d high = low;
  for (const MeshVertex& v : mesh.vertices) {
    low = low.cwiseMin(v.position);
    high = high.cwiseMax(v.position);
  }
  EXPECT_NEAR(low.x(), -3, 0.01);
  EXPECT_NEAR(high.x(), 3.434, 0.01);
  EXPECT_NEAR(high.y(), 2, 0.01);
  EXPECT_NEAR(low.z(), 0, 1e-12);
  EXPECT_NEAR(high.z(), 3.15, 1e-12);
  EXPECT_GT(volume(mesh), 0);
  // On the belly normals point away from the axis; the outside bends away.
  int on_belly = 0;
  for (const MeshVertex& v : mesh.vertices) {
    const double axial = v.position.head<2>().norm();
    if (std::abs(v.position.z() - 0.9) > 1e-9 || std::abs(axial - 2) > 0.03 || v.position.x() < -1.9)
      continue;  // or the handle's end
    ++on_belly;
    ASSERT_GT(v.normal.head<2>().dot(v.position.head<2>()), 0.9 * axial);
    ASSERT_NEAR(v.curvature.x(), 0.5 / axial, 0.05);  // quarters of it are no circles
  }
  EXPECT_GT(on_belly, 64);
}

RawMesh read(const std::string& text) {
  std::istringstream in(text);
  return read_obj(in, "a.obj");
}

std::string error_of(const std::string& text) {
  try {
    static_cast<void>(read(text));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Obj, reads_faces_by_number_and_backwards) {
  const std::string points = "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0\r\nv 0 1 0\nvt 0 0\nvt 1 0 0\nvt 1 1\nvt 0 1\nvn 0 0 2\n";
  const RawMesh fan = read("# a square\no square\n" + points + "f 1/1 2/2 3/3 4/4 # all\n");
  EXPECT_EQ(fan.triangles.size(), 2U);
  EXPECT_TRUE(fan.normals.empty());
  const RawMesh back = read(points + "s off\nf -4/-4/-1 -3/-3/-1 -2/-2/-1\n\nf 1/1/1 3/3/1 4/4/1");
  EXPECT_EQ(back.triangles.size(), 2U);
  const Mesh mesh = finish(back);
  EXPECT_EQ(mesh.vertices.size(), 4U);
  EXPECT_EQ(mesh.vertices.front().normal, Vector3d::UnitZ());
  EXPECT_EQ(mesh.vertices[2].uv, Vector2d(1, 0)) << "v goes down";
}

TEST(Obj, says_what_is_wrong_where) {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "a.obj: no face"},
      {"v 0 0\n", "a.obj:1: expected v and three numbers, found the line's end"},
      {"v 0 0 zero\n", "a.obj:1: expected v and three numbers, found 'zero'"},
      {"v 0 0 1e999\n", "found '1e999'"},
      {"v 0 0 nan\n", "found 'nan'"},
      {"vt 0\n", "a.obj:1: expected vt and two numbers"},
      {"vn 0 0 1 0\n", "a.obj:1: expected the line's end, found '0'"},
      {"vp 1 2\n", "a.obj:1: expected v, vt, vn or f, found 'vp'"},
      {points + "f 1 2 3\n", "a.obj:7: expected a corner v/vt or v/vt/vn"},
      {points + "f 1//1 2//1 3//1\n", "a.obj:7: expected a corner v/vt or v/vt/vn"},
      {points + "f 1/1 2/2\n", "a.obj:7: expected three corners at least"},
      {points + "f 1/1 2/2 4/3\n", "a.obj:7: expected the number of one of 3 v, found '4'"},
      {points + "f 1/1 2/2 3/0\n", "a.obj:7: expected the number of one of 3 vt, found '0'"},
      {points + "f 1/1 2/2 -4/3\n", "found '-4'"},
      {points + "f 1/1/1 2/2/1 3/3/1\n", "a.obj:7: expected the number of one of 0 vn"},
      {points + "vn 0 0 1\nf 1/1/1 2/2 3/3\n", "a.obj:8: expected vn at all corners"},
      {points + "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1\nf 1/1 2/2 3/3\n", "expected all or none"},
      {points + "f 1/1 2/2 \\\n3/3\n", "a.obj:7: expected a line that ends in itself"}};
  for (const auto& [text, message] : cases) EXPECT_THAT(error_of(text), HasSubstr(message)) << text;
  EXPECT_THROW(static_cast<void>(load_obj("/nowhere.obj")), Error);
}

TEST(Obj, holds_to_its_limit) {
  std::string text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\n";
  std::string face = "f";
  for (std::size_t i = 0; i < kMostTriangles + 3; ++i) face += " 1/1";
  EXPECT_THAT(error_of(text + face), HasSubstr("triangles at most"));
}

}  // namespace
}  // namespace reliefbench
