#include "kernels/trace/mesh_frame.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/error.h"
#include "kernels/mesh/meshes.h"
#include "kernels/trace/surface_tracer.h"

namespace reliefbench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNoHit = std::numeric_limits<double>::infinity();
constexpr double kSameWay = 1e-9;  ///< in sides of the unit square: what rounding makes of one point's way

Vector3d first_three(const std::array<float, 4>& numbers) { return Eigen::Vector3f(numbers.data()).cast<double>(); }

}  // namespace

Mesh load_mesh(const Surface& surface) {
  Mesh mesh = scene_mesh(surface.mesh, surface.segments);
  if (!surface.sha256.empty() && mesh_sha256(mesh) != surface.sha256)
    fail_input("{}: the mesh is another one than when the scene was read", surface.mesh);
  return mesh;
}

MeshFrame::MeshFrame(const ReferenceTracer& heights, const Mesh& mesh, const FrameUniforms& frame)
    : heights_(heights),
      mesh_(mesh),
      frame_(frame),
      relief_{.depth = static_cast<double>(frame.position[3]) / static_cast<double>(frame.right[3]),
              .tiling = static_cast<double>(frame.right[3])},
      tracer_(heights, mesh, relief_) {}

std::optional<MeshFrame::Entry> MeshFrame::entry(int x, int y) const {
  const double right = (x + 0.5) / frame_.sizes[0] * 2 - 1;
  const double down = (y + 0.5) / frame_.sizes[1] * 2 - 1;
  const Vector3d along =
      first_three(frame_.forward) + first_three(frame_.right) * right - first_three(frame_.up) * down;
  Entry entry{.line = {.from = first_three(frame_.position), .direction = along.normalized()}, .hit = {}, .ray = {}};
  const auto near_plane = static_cast<double>(frame_.up[3]);
  const auto met = tracer_.meet(entry.line, MeshTracer::Side::outside, near_plane * along.norm());
  if (!met) return std::nullopt;
  entry.hit = *met;
  entry.ray = mesh_ray(mesh_, relief_, entry.line, entry.hit);
  return entry;
}

ReferenceHit MeshFrame::trace(const Entry& entry) const {
  if (relief_.depth == 0)  // all of its heights are in one place
    return heights_.trace(
        TextureRay{.u = static_cast<float>(entry.ray.uv.x()), .v = static_cast<float>(entry.ray.uv.y())});
  const auto t_of = [&](const MeshHit& hit) { return std::max(0.0, (hit.way - entry.hit.way) / entry.ray.per_t); };
  const auto out = tracer_.meet(entry.line, MeshTracer::Side::inside, entry.hit.way);
  double end = kNoHit;
  if (out) end = out->way;
  const auto hit = tracer_.trace(entry.line, MeshTracer::Side::outside, entry.hit.way - kSameWay, end);
  if (!hit) return {.t_enter = kNoHit, .t_exit = kNoHit};
  const auto exit = tracer_.trace(entry.line, MeshTracer::Side::inside, hit->way, end);
  ReferenceHit found{.t_enter = t_of(*hit), .t_exit = kNoHit};
  if (exit) found.t_exit = t_of(*exit);
  return found;
}

std::optional<MeshHit> MeshFrame::hit_at(const Entry& entry, double t) const {
  const double way = entry.hit.way + t * entry.ray.per_t;
  return tracer_.trace(entry.line, MeshTracer::Side::outside, way - 2 * kSameWay, way + 2 * kSameWay);
}

std::vector<ReferenceHit> exact_hits_on_mesh(const MeshFrame& mesh, const FrameUniforms& frame,
                                             std::span<const ScorePixel> pixels) {
  std::vector<ReferenceHit> hits(pixels.size());
  const Eigen::Array2d sides(frame.sizes[2], frame.sizes[3]);
  for_each_pixel(frame, [&](std::size_t i, int x, int y) {
    if (pixels[i].status == static_cast<float>(PixelStatus::no_ray)) return;
    const auto entry = mesh.entry(x, y);
    if (entry) hits[i] = mesh.trace(*entry);
    const auto is_same = [&] {
      Eigen::Array2d apart = entry->ray.uv.array();
      apart -= Eigen::Array2d(static_cast<double>(pixels[i].ray.u), static_cast<double>(pixels[i].ray.v));
      apart -= apart.round();  // whole tiles
      return (apart * sides).matrix().norm() <= kSameEntry;
    };
    // What is shown of it is as good as any.
    if (!entry)
      hits[i] = {.t_enter = kNoHit, .t_exit = -1};
    else if (!is_same())
      hits[i].t_exit = -1;
  });
  return hits;
}

FeatureValues places_on_mesh(const MeshFrame& mesh, const FrameUniforms& frame, std::span<const ReferenceHit> hits) {
  FeatureValues places(3, std::vector<float>(hits.size()));
  for_each_pixel(frame, [&](std::size_t i, int x, int y) {
    if (hits[i].passes()) return;
    const auto entry = mesh.entry(x, y);
    const auto hit = entry ? mesh.hit_at(*entry, hits[i].t_enter) : std::nullopt;
    if (!hit) return;
    places[0][i] = static_cast<float>(hit->triangle);
    places[1][i] = static_cast<float>(hit->weights.y());
    places[2][i] = static_cast<float>(hit->weights.z());
  });
  return places;
}

}  // namespace reliefbench
