#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "backends/backend.h"
#include "kernels/maps/map_texture.h"
#include "kernels/mesh/mesh.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"
#include "tuner/measure/bake.h"

namespace reliefbench {

/// Map -> textures, in the settings' format and encoding. Nothing where their technique reads no map.
[[nodiscard]] std::optional<MapTextures> pack(const Settings& settings, const BakedMap& map, const Scene& scene);

/// What a relief's mesh is on a device.
struct UploadedMesh {
  std::unique_ptr<Texture> corners{};  ///< null: there is no mesh
  int vertices = 0;
};
[[nodiscard]] UploadedMesh upload(Backend& backend, const Mesh& mesh);

/// What all frames of a scene share on a device.
struct UploadedScene {
  std::unique_ptr<Texture> normals{};
  std::unique_ptr<const Mesh> mesh{};  ///< that the relief lies on, if it lies on one
  UploadedMesh uploaded_mesh{};
  Wrap wrap = Wrap::repeat;
  bool is_solid = false;  ///< rays may pass
  FrameUniforms frame{};
};
/// heights: as they were read. throws: as load_mesh()
[[nodiscard]] UploadedScene upload(Backend& backend, const Scene& scene, const Heightfield& heights);

/// A setting's frame on a device: textures of its map and a draw that reads them.
struct Frame {
  std::unique_ptr<Texture> relief{};  ///< null where there is no map
  std::unique_ptr<Texture> extra{};   ///< null where the map has one texture
  Draw draw{};                        ///< without a pipeline

  [[nodiscard]] Draw with(const Pipeline& pipeline) const;
};
/// The draws of a setting's relief: one, or as many as its technique has passes. Later passes are nearer and replace
/// what was drawn; with depth they come first, for what is as near is not replaced then.
[[nodiscard]] std::vector<Draw> passes_of(const Settings& settings, const Draw& relief, const Target& target);
/// Textures -> frame. The scene must outlive it.
[[nodiscard]] Frame upload(Backend& backend, const std::optional<MapTextures>& map, const UploadedScene& scene);

/// The exact hits of a frame's pixels, with the exact values of features of the scene that it has, as the shader
/// "reference" reads them; on a mesh, where no feature has any, with places_on_mesh().
[[nodiscard]] std::unique_ptr<Texture> upload_exact(Backend& backend, std::span<const ReferenceHit> hits,
                                                    const FeatureValues& values, const FrameUniforms& frame);
/// A draw that shades them, without a pipeline. exact: of upload_exact()
[[nodiscard]] Draw reference_draw(const UploadedScene& scene, const Texture& exact, const FrameUniforms& frame);

/// The mean of pictures of one size, RGBA8.
class PictureMean {
 public:
  void add(std::span<const std::uint8_t> picture);
  /// Rounded. picture: one of that size, whose alpha stays: it says which object is seen, as no mean could
  void put_colors(std::span<std::uint8_t> picture) const;

 private:
  std::vector<int> sums_;
  int count_ = 0;
};

/// Frame -> the ray of each pixel and the hit that was found. frame: its draws, with pipelines of Target::score; into:
/// what is in it goes, its memory is used again
void trace_frame(Backend& backend, std::span<const Draw> frame, std::vector<ScorePixel>& into);
[[nodiscard]] std::vector<ScorePixel> trace_frame(Backend& backend, std::span<const Draw> frame);
[[nodiscard]] std::vector<ScorePixel> trace_frame(Backend& backend, const Draw& draw);
/// The picture of the same trace, RGBA8. frame: its draws, with pipelines of color_target()
void shade_frame(Backend& backend, std::span<const Draw> frame, std::vector<std::uint8_t>& into);
[[nodiscard]] std::vector<std::uint8_t> shade_frame(Backend& backend, std::span<const Draw> frame);

}  // namespace reliefbench
