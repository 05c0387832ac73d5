#pragma once
#include <span>
#include <vector>

#include "kernels/judge/score_pixel.h"
#include "kernels/trace/feature.h"
#include "kernels/trace/mesh_tracer.h"
#include "kernels/trace/view.h"

namespace reliefbench {

// Frames of a relief on a mesh. A pixel is of the nearest triangle that is seen from outside: its ray ends in the
// relief under it, or where the line leaves the mesh again. What stands behind that is another fragment's.

/// The mesh of a scene's surface.
/// throws: as scene_mesh(); Error(bad_input): its file has changed since Surface::sha256 was made
[[nodiscard]] Mesh load_mesh(const Surface& surface);

class MeshFrame {
 public:
  /// All of them must outlive it. frame: the camera, relief depth and tiling
  MeshFrame(const ReferenceTracer& heights, const Mesh& mesh, const FrameUniforms& frame);

  /// A pixel's line in the world, and where it enters.
  struct Entry {
    MeshLine line;
    MeshHit hit;
    MeshRay ray;
  };
  [[nodiscard]] std::optional<Entry> entry(int x, int y) const;
  /// As trace_surface(): t counts in the plane that touches where the line enters.
  [[nodiscard]] ReferenceHit trace(const Entry& entry) const;
  /// Where the relief is met at that t of trace().
  [[nodiscard]] std::optional<MeshHit> hit_at(const Entry& entry, double t) const;

 private:
  const ReferenceTracer& heights_;
  const Mesh& mesh_;
  const FrameUniforms& frame_;
  MeshRelief relief_;
  MeshTracer tracer_;
};

/// Exact hits of a score frame's pixels. Where a device rasterises another triangle than the exact line meets, as it
/// may on edges, the pixel's ray is another one's, and nothing can be said of it: is_unknown().
[[nodiscard]] std::vector<ReferenceHit> exact_hits_on_mesh(const MeshFrame& mesh, const FrameUniforms& frame,
                                                           std::span<const ScorePixel> pixels);
[[nodiscard]] inline bool is_unknown(const ReferenceHit& hit) { return hit.t_exit < hit.t_enter; }
inline constexpr double kSameEntry = 0.5;  ///< texels that a pixel's own entry is off the exact one at most

/// Where on the mesh those hits are, one list each: the triangle and the weights of its second and third corner. What
/// the shader "reference" reads beside t.
[[nodiscard]] FeatureValues places_on_mesh(const MeshFrame& mesh, const FrameUniforms& frame,
                                           std::span<const ReferenceHit> hits);

}  // namespace reliefbench
