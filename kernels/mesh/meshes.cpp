#include "kernels/mesh/meshes.h"

#include <algorithm>

#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "kernels/mesh/obj.h"

namespace reliefbench {
namespace {

RawMesh torus_of(int segments) { return torus(8 * segments, 4 * segments); }

constexpr std::array kNamedMeshes{
    MeshRow{.id = "teapot",
            .description = "the Utah teapot, the whole map on each of its 32 patches",
            .source = "Newell 1975; Blinn's flat form",
            .make = teapot},
    MeshRow{.id = "torus",
            .description = "a torus round the z axis, 4 sides of the unit square round its ring and 1 round its tube",
            .source = "-",
            .make = torus_of}};

}  // namespace

std::span<const MeshRow> named_meshes() { return kNamedMeshes; }

const MeshRow* find_named_mesh(std::string_view id) {
  const auto* const found = std::ranges::find(kNamedMeshes, id, &MeshRow::id);
  return found == kNamedMeshes.end() ? nullptr : found;
}

Mesh scene_mesh(const std::string& source, int segments) {
  const MeshRow* const row = find_named_mesh(source);
  const Mesh mesh = finish(row == nullptr ? load_obj(source) : row->make(segments));
  if (mesh.triangles.empty()) fail_input("{}: no triangle of the mesh has an area", source);
  return placed(mesh, {0.5, 0.5, 0}, kMeshRadius);
}

MeshTexels mesh_texels(const Mesh& mesh) {
  constexpr std::size_t kWidth = std::size_t{1} << kMeshTexelsBits;
  const std::size_t count = 3 * mesh.triangles.size() * kMeshTexels;
  const std::size_t rows = std::max<std::size_t>((count + kWidth - 1) / kWidth, 1);
  MeshTexels image{.width = static_cast<int>(kWidth), .height = static_cast<int>(rows), .rgba = {}};
  image.rgba.reserve(4 * kWidth * rows);
  const auto add = [&](const Eigen::Vector3d& v, double w) {
    for (const double number : {v.x(), v.y(), v.z(), w}) image.rgba.push_back(static_cast<float>(number));
  };
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) {
      const MeshVertex& vertex = mesh.vertices[corner];
      add(vertex.position, vertex.uv.x());
      add(vertex.normal, vertex.uv.y());
      add(vertex.u_gradient, vertex.curvature.x());
      add(vertex.v_gradient, vertex.curvature.y());
      add({vertex.curvature.z(), 0, 0}, 0);
    }
  image.rgba.resize(4 * kWidth * rows);
  return image;
}

std::string mesh_sha256(const Mesh& mesh) {
  const MeshTexels image = mesh_texels(mesh);
  return sha256(std::as_bytes(std::span(image.rgba)));
}

}  // namespace reliefbench
