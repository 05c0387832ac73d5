// Exact hits on displaced meshes: against Embree, against what is known, and against the exact torus.
#include "kernels/trace/mesh_tracer.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "kernels/trace/surface_tracer.h"
#include "tests/embree_mesh.h"

namespace reliefbench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Heightfield hills(int side, unsigned seed) {
  std::mt19937 random(seed);
  Heightfield map{.width = side, .height = side, .texels = {}};
  for (int i = 0; i < side * side; ++i) map.texels.push_back(static_cast<float>(random() % 1024) / 1023.0F);
  return map;
}

Heightfield level(float height) { return {.width = 2, .height = 2, .texels = std::vector<float>(4, height)}; }

/// Lines from outside at random points near the mesh.
std::vector<MeshLine> lines_at(const Mesh& mesh, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-1, 1);
  double reach = 0;
  for (const MeshVertex& v : mesh.vertices) reach = std::max(reach, v.position.norm());
  std::vector<MeshLine> lines;
  while (static_cast<int>(lines.size()) < count) {
    const Vector3d from(any(random), any(random), any(random));
    const Vector3d to(any(random), any(random), any(random));
    if (from.norm() < 0.1 || from.norm() > 1 || to.norm() > 1) continue;
    const Vector3d start = from.normalized() * (3 * reach);
    lines.push_back({.from = start, .direction = (to * reach - start).normalized()});
  }
  return lines;
}

TEST(MeshTracer, finds_what_embree_finds_on_the_same_parts) {
  const Heightfield map = hills(8, 1);
  const ReferenceTracer heights(map, Wrap::repeat);
  const MeshRelief relief{.depth = 0.3, .tiling = 1};
  // Coarse parts on both sides, so that Embree can hold them: edges are of over 2 and of over 4 texels.
  for (const auto& [mesh, steps] : {std::pair(finish(torus(16, 8)), 16), std::pair(finish(teapot(2)), 32)}) {
    const MeshTracer tracer(heights, mesh, relief, 0.25);
    ASSERT_LE(tracer.share(), 0.25);
    ASSERT_GT(tracer.share(), 0.125);
    const EmbreeMesh embree(mesh, map, relief, steps);
    int differ = 0;
    int hits = 0;
    const std::vector<MeshLine> lines = lines_at(mesh, 4000, 2);
    for (const MeshLine& line : lines) {
      const double other = embree.first_hit(line);
      const auto outside = tracer.trace(line, MeshTracer::Side::outside, 0);
      const auto inside = tracer.trace(line, MeshTracer::Side::inside, 0);
      double own = std::numeric_limits<double>::infinity();
      if (outside) own = std::min(own, outside->way);
      if (inside) own = std::min(own, inside->way);
      hits += std::isfinite(own) ? 1 : 0;
      // Rays that graze a part's edge may end elsewhere in floats.
      if (!(own == other || std::abs(own - other) < 2e-5 * (1 + own))) ++differ;
    }
    EXPECT_GT(hits, 1000) << steps;
    EXPECT_LE(differ, 8) << steps;
  }
}

TEST(MeshTracer, of_a_full_height_finds_the_mesh_itself) {
  const Mesh mesh = finish(teapot(3));
  const ReferenceTracer heights(level(1), Wrap::repeat);
  const MeshTracer tracer(heights, mesh, {.depth = 0.2, .tiling = 1});
  int hits = 0;
  for (const MeshLine& line : lines_at(mesh, 2000, 3))
    for (const MeshTracer::Side side : {MeshTracer::Side::outside, MeshTracer::Side::inside}) {
      const auto on_mesh = tracer.meet(line, side, 0);
      const auto on_relief = tracer.trace(line, side, 0);
      ASSERT_EQ(on_mesh.has_value(), on_relief.has_value());
      if (!on_mesh) continue;
      ++hits;
      EXPECT_NEAR(on_mesh->way, on_relief->way, 1e-9);
      EXPECT_NEAR(on_relief->weights.sum(), 1, 1e-9);
    }
  EXPECT_GT(hits, 1000);
}

TEST(MeshTracer, lets_no_line_through_a_closed_mesh) {
  // Towards points on edges and corners, where neighbouring triangles and parts meet.
  const Mesh mesh = finish(torus(12, 8));
  const Heightfield map = hills(4, 4);
  const ReferenceTracer heights(map, Wrap::repeat);
  const MeshTracer tracer(heights, mesh, {.depth = 0.2, .tiling = 1}, 0.125);
  std::mt19937 random(5);
  for (int i = 0; i < 3000; ++i) {
    const auto& triangle = mesh.triangles[random() % mesh.triangles.size()];
    const double along = static_cast<double>(random() % 9) / 8;
    const Vector3d target =
        mesh.vertices[triangle[0]].position * along + mesh.vertices[triangle[1]].position * (1 - along);
    const Vector3d middle = Vector3d(target.x(), target.y(), 0).normalized() * kTorusRing;  // in the tube
    const Vector3d from = middle + (target - middle) * 1.9;
    const MeshLine line{.from = from, .direction = (middle - from).normalized()};
    const auto mesh_hit = tracer.meet(line, MeshTracer::Side::outside, 0);
    const auto hit = tracer.trace(line, MeshTracer::Side::outside, 0);
    ASSERT_TRUE(mesh_hit && hit) << i;
    EXPECT_GE(hit->way, mesh_hit->way - 1e-9);
  }
}

TEST(MeshTracer, ends_at_extremes) {
  const Heightfield map = hills(16, 11);
  const ReferenceTracer heights(map, Wrap::repeat);
  RawMesh constant = torus(12, 8);
  for (Vector2d& uv : constant.uvs) uv = {0.3, 0.7};
  RawMesh huge = torus(12, 8);
  for (Vector2d& uv : huge.uvs) uv *= 1e6;
  RawMesh collapsed = torus(12, 8);
  for (std::size_t i = 0; i < collapsed.triangles.size(); i += 3) collapsed.triangles[i][1] = collapsed.triangles[i][0];
  // A map of one point, one of millions of texels along an edge, triangles without area, and a relief that is deeper
  // than the tube is round.
  for (const auto& [raw, depth] : {std::pair(constant, 0.2), {huge, 0.2}, {collapsed, 0.2}, {torus(12, 8), 1.5}}) {
    const Mesh mesh = finish(raw);
    const MeshRelief relief{.depth = depth, .tiling = 1};
    const MeshTracer tracer(heights, mesh, relief);
    int hits = 0;
    for (const MeshLine& line : lines_at(mesh, 8, 12)) {
      const auto entry = tracer.meet(line, MeshTracer::Side::outside, 0);
      if (entry) {
        const MeshRay ray = mesh_ray(mesh, relief, line, *entry);
        EXPECT_TRUE(ray.slope.allFinite() && std::isfinite(ray.bend) && std::isfinite(ray.per_t));
        EXPECT_GE(ray.cosine, 0.99 * kLeastCosine);
      }
      const auto hit = tracer.trace(line, MeshTracer::Side::outside, 0);
      if (!hit) continue;
      ++hits;
      EXPECT_TRUE(std::isfinite(hit->way));
      EXPECT_GE(hit->weights.minCoeff(), -1e-9);
      EXPECT_NEAR(hit->weights.sum(), 1, 1e-9);
    }
    EXPECT_GT(hits, 1);
  }
  // Of one point of the map the relief is a torus that is thinner by what is missing there.
  const Mesh mesh = finish(constant);
  const MeshTracer tracer(heights, mesh, {.depth = 0.2, .tiling = 1});
  const MeshLine down{.from = {kTorusRing, 0, 3}, .direction = -Vector3d::UnitZ()};
  const ReferenceTracer::Corners h = heights.corners(4, 10);  // round (4.3, 10.7), centres at whole numbers
  const double height = std::lerp(std::lerp(h.h00, h.h10, 0.3), std::lerp(h.h01, h.h11, 0.3), 0.7);
  const auto hit = tracer.trace(down, MeshTracer::Side::outside, 0);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->way, 2 + 0.2 * (1 - height), 1e-9);
}

/// The places of two hits on the map, in texels.
double texels_apart(const Mesh& mesh, const MeshHit& a, const MeshHit& b, double side) {
  const auto uv = [&](const MeshHit& hit) -> Vector2d {
    Vector2d sum = Vector2d::Zero();
    for (std::size_t i = 0; i < 3; ++i)
      sum += hit.weights(static_cast<Eigen::Index>(i)) * mesh.vertices[mesh.triangles[hit.triangle].at(i)].uv;
    return sum;
  };
  Vector2d way = uv(a) - uv(b);
  way -= way.array().round().matrix();
  return way.norm() * side;
}

TEST(MeshTracer, errs_by_little_as_half_the_edge_shows) {
  const Mesh mesh = finish(torus(32, 12));
  const Heightfield map = hills(32, 6);
  const ReferenceTracer heights(map, Wrap::repeat);
  const MeshRelief relief{.depth = 0.1, .tiling = 1};
  const MeshTracer fine(heights, mesh, relief);
  const MeshTracer finer(heights, mesh, relief, 0.5 * MeshTracer::kShare);
  EXPECT_NEAR(finer.share(), 0.5 * fine.share(), 1e-12);
  std::vector<double> apart;
  int differ = 0;
  for (const MeshLine& line : lines_at(mesh, 1500, 7)) {
    const auto a = fine.trace(line, MeshTracer::Side::outside, 0);
    const auto b = finer.trace(line, MeshTracer::Side::outside, 0);
    if (a.has_value() != b.has_value()) ++differ;
    if (a && b) apart.push_back(texels_apart(mesh, *a, *b, 32));
  }
  std::ranges::sort(apart);
  EXPECT_LT(apart[apart.size() / 2], 1e-5);
  EXPECT_LT(apart[apart.size() * 99 / 100], 1e-3);
  EXPECT_LE(differ, 1);
}

/// The torus of surface.h, whose axis is parallel to y, as a mesh in its own place.
Mesh mesh_of_torus(const SurfaceShape& shape, int ring_segments, int tube_segments) {
  Mesh mesh = finish(torus(ring_segments, tube_segments));
  // u runs from z towards x, where the mesh has x towards y; v from outside towards y, where it has z.
  Eigen::Matrix3d turn;
  turn.col(0) = Vector3d::UnitZ();
  turn.col(1) = Vector3d::UnitX();
  turn.col(2) = Vector3d::UnitY();
  for (MeshVertex& v : mesh.vertices) {
    v.position = Vector3d(0.5, 0.5, -shape.ring - shape.tube) + turn * v.position * shape.tube;
    for (Vector3d* const vector : {&v.normal, &v.u_gradient, &v.v_gradient}) *vector = turn * *vector;
    v.u_gradient /= shape.tube;
    v.v_gradient /= shape.tube;
    v.curvature /= shape.tube;
    v.uv += Vector2d(0.5, 0.5);  // the middle of the unit square is on top
  }
  return mesh;
}

TEST(MeshTracer, comes_to_the_exact_torus_as_the_mesh_gets_finer) {
  Scene scene{.view = view_presets()[1], .relief_depth = 0.05, .width_px = 48, .height_px = 48};
  scene.surface = {.kind = SurfaceKind::torus, .round = 4, .tube = 1};
  const Heightfield map = hills(16, 8);
  const ReferenceTracer heights(map, Wrap::repeat);
  const FrameUniforms frame = frame_uniforms(scene, map.width, map.height);
  const SurfaceShape shape(frame);
  std::vector<double> medians;
  for (const int segments : {32, 64, 128}) {
    const Mesh mesh = mesh_of_torus(shape, segments * 2, segments);
    const MeshTracer tracer(heights, mesh, {.depth = shape.relief, .tiling = shape.tiling});
    std::vector<double> apart;
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 48; ++x) {
        const SurfaceRay ray = surface_ray(frame, shape, Wrap::repeat, x, y);
        if (!ray.enters || ray.cosine < 0.2) continue;
        const ReferenceHit exact = trace_surface(heights, shape, ray, Wrap::repeat);
        if (exact.passes()) continue;
        const MeshLine line{.from = Vector3d(ray.from.data()), .direction = Vector3d(ray.direction.data())};
        const auto hit = tracer.trace(line, MeshTracer::Side::outside, 0);
        if (hit) apart.push_back(std::abs(hit->way - ray.way - exact.t_enter * ray.per_t));
      }
    ASSERT_GT(apart.size(), 500U);
    std::ranges::sort(apart);
    medians.push_back(apart[apart.size() / 2]);
  }
  // A polygon is off a circle by the square of its edge.
  EXPECT_LT(medians[1], 0.35 * medians[0]);
  EXPECT_LT(medians[2], 0.35 * medians[1]);
}

TEST(MeshRay, is_the_plane_ray_on_a_plane_and_bends_on_a_sphere) {
  // A square with its uv as its plane: the slope is that of pixel_ray.
  RawMesh raw;
  for (const auto& [x, y] : {std::pair(0.0, 0.0), {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}) {
    raw.positions.emplace_back(x, y, 0);
    raw.uvs.emplace_back(x, y);
  }
  using Corner = RawMesh::Corner;
  raw.triangles = {{Corner{0, 0, 0}, {1, 1, 0}, {2, 2, 0}}, {Corner{0, 0, 0}, {2, 2, 0}, {3, 3, 0}}};
  const Mesh square = finish(raw);
  const Heightfield map = hills(8, 9);
  const ReferenceTracer heights(map, Wrap::repeat);
  const MeshRelief relief{.depth = 0.1 / 2, .tiling = 2};
  const MeshTracer tracer(heights, square, relief);
  std::mt19937 random(10);
  std::uniform_real_distribution<double> any(0.3, 0.7);
  for (int i = 0; i < 500; ++i) {
    const Vector3d from(any(random), any(random), 1);
    const MeshLine line{.from = from, .direction = (Vector3d(any(random), any(random), 0) - from).normalized()};
    const auto entry = tracer.meet(line, MeshTracer::Side::outside, 0);
    ASSERT_TRUE(entry);
    const MeshRay ray = mesh_ray(square, relief, line, *entry);
    EXPECT_EQ(ray.bend, 0);
    const TextureRay plane{.u = static_cast<float>(ray.uv.x()),
                           .v = static_cast<float>(ray.uv.y()),
                           .slope_u = static_cast<float>(ray.slope.x()),
                           .slope_v = static_cast<float>(ray.slope.y())};
    const auto hit = tracer.trace(line, MeshTracer::Side::outside, 0);
    ASSERT_TRUE(hit);
    // The mesh's parts are flat; the exact tracer's cells are not.
    EXPECT_NEAR((hit->way - entry->way) / ray.per_t, heights.first_hit(plane), 2e-4) << i;
  }
}

TEST(MeshRay, bends_as_the_exact_torus_does) {
  Scene scene{.view = view_presets()[1], .relief_depth = 0.05, .width_px = 48, .height_px = 48};
  scene.surface = {.kind = SurfaceKind::torus, .round = 4, .tube = 1};
  const Heightfield map = hills(16, 8);
  const ReferenceTracer heights(map, Wrap::repeat);
  const FrameUniforms frame = frame_uniforms(scene, map.width, map.height);
  const SurfaceShape shape(frame);
  const MeshRelief relief{.depth = shape.relief, .tiling = shape.tiling};
  const Mesh mesh = mesh_of_torus(shape, 256, 96);
  const MeshTracer tracer(heights, mesh, relief);
  int compared = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 48; ++x) {
      const SurfaceRay exact = surface_ray(frame, shape, Wrap::repeat, x, y);
      if (!exact.enters || exact.cosine < 0.2) continue;
      const MeshLine line{.from = Vector3d(exact.from.data()), .direction = Vector3d(exact.direction.data())};
      const auto entry = tracer.meet(line, MeshTracer::Side::outside, 0);
      ASSERT_TRUE(entry);
      const MeshRay ray = mesh_ray(mesh, relief, line, *entry);
      ++compared;
      EXPECT_NEAR(entry->way, exact.way, 5e-3);
      const Vector2d away = ray.uv - Vector2d(exact.uv[0], exact.uv[1]) * shape.tiling;
      EXPECT_LT((away - away.array().round().matrix()).norm(), 5e-3);
      // A polygon's edge and its normals are off by the square of a segment, the more so the flatter the ray.
      ASSERT_LT((ray.slope - Vector2d(exact.slope[0], exact.slope[1])).norm(), 0.05 * (1 + ray.slope.norm()));
      ASSERT_NEAR(ray.bend, exact.bend, 0.1 * (0.02 + std::abs(exact.bend)));
      ASSERT_NEAR(ray.per_t, exact.per_t, 0.05 * exact.per_t);
    }
  EXPECT_GT(compared, 500);
}

}  // namespace
}  // namespace reliefbench
