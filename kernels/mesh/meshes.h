#pragma once
#include <span>
#include <string>
#include <string_view>

#include "kernels/mesh/mesh.h"

namespace reliefbench {

/// A mesh that has a name.
struct MeshRow {
  std::string_view id;
  std::string_view description;
  std::string_view source;
  RawMesh (*make)(int segments);  ///< 1 to kMostSegments
};
[[nodiscard]] std::span<const MeshRow> named_meshes();
/// Null: no such mesh.
[[nodiscard]] const MeshRow* find_named_mesh(std::string_view id);
inline constexpr int kMostSegments = 64;  ///< of which none has over kMostTriangles

/// A named mesh, or that of an OBJ file, as scenes have it: its middle in the middle of the unit square, where cameras
/// look, and its farthest point at kMeshRadius from there.
/// throws: Error(bad_input): as load_obj(), and where no triangle has an area
[[nodiscard]] Mesh scene_mesh(const std::string& source, int segments);
inline constexpr double kMeshRadius = 0.45;  ///< sides of the unit square: views with the square have all of it

/// What shaders read of a mesh, RGBA32F: for each corner of each triangle (position, u) (normal, v) (gradient of u,
/// curvature a) (gradient of v, b) (c, 0, 0, 0), kMeshTexels in a row that goes on in the next of the image.
struct MeshTexels {
  int width = 0;
  int height = 0;
  std::vector<float> rgba;
};
inline constexpr int kMeshTexels = 5;       ///< a corner
inline constexpr int kMeshTexelsBits = 11;  ///< the image is 2^this wide
[[nodiscard]] MeshTexels mesh_texels(const Mesh& mesh);
/// SHA-256 of those.
[[nodiscard]] std::string mesh_sha256(const Mesh& mesh);

}  // namespace reliefbench
