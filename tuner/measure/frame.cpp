#include "tuner/measure/frame.h"

#include <algorithm>
#include <functional>
#include <span>

#include "kernels/image/heightmap.h"
#include "kernels/mesh/meshes.h"
#include "kernels/trace/mesh_frame.h"

namespace reliefbench {
namespace {

constexpr std::size_t kMostChannels = 4;

/// Of the relief of a scene, without its map.
Draw draw_of(const UploadedScene& scene, const FrameUniforms& frame) {
  const Texture* const normals = scene.normals.get();  // any texture where the map has none
  Draw draw{.textures = {{kReliefMap, normals}, {kNormalMap, normals}, {kExtraMap, normals}}, .frame = frame};
  if (const UploadedMesh& mesh = scene.uploaded_mesh; mesh.corners) {
    draw.textures[kMeshMap] = mesh.corners.get();
    draw.vertices = mesh.vertices;
  }
  return draw;
}

}  // namespace

std::optional<MapTextures> pack(const Settings& settings, const BakedMap& map, const Scene& scene) {
  if (!settings.technique().reads_map()) return std::nullopt;
  const MapStorage storage = storage_of(settings);
  const std::vector<MapValue> parameters = map_values(settings);
  return pack_map({.map = storage.map,
                   .heights = map.heights,
                   .values = map.values,
                   .wrap = scene.wrap,
                   .relief_depth = scene.relief_depth,
                   .mips = mips_of(settings),
                   .parameters = parameters},
                  storage.format, storage.encoding);
}

UploadedMesh upload(Backend& backend, const Mesh& mesh) {
  const MeshTexels image = mesh_texels(mesh);
  return {.corners = backend.upload({.width = image.width,
                                     .height = image.height,
                                     .layout = {.type = TexelType::float32, .channels = 4},
                                     .texels = std::as_bytes(std::span(image.rgba)),
                                     .wrap = Wrap::clamp,
                                     .filter = Filter::nearest}),
          .vertices = static_cast<int>(3 * mesh.triangles.size())};
}

UploadedScene upload(Backend& backend, const Scene& scene, const Heightfield& heights) {
  std::unique_ptr<const Mesh> mesh;
  if (scene.surface.kind == SurfaceKind::mesh) mesh = std::make_unique<const Mesh>(load_mesh(scene.surface));
  UploadedMesh uploaded_mesh = mesh ? upload(backend, *mesh) : UploadedMesh{};
  std::vector<std::uint8_t> normals = normal_map(heights, scene.wrap, scene.relief_depth);
  const int levels = append_levels(normals, heights.width, heights.height);
  return {.normals = backend.upload({.width = heights.width,
                                     .height = heights.height,
                                     .levels = levels,
                                     .texels = std::as_bytes(std::span(normals)),
                                     .wrap = scene.wrap}),
          .mesh = std::move(mesh),
          .uploaded_mesh = std::move(uploaded_mesh),
          .wrap = scene.wrap,
          .is_solid = heights.is_solid(),
          .frame = frame_uniforms(scene, heights.width, heights.height)};
}

Draw Frame::with(const Pipeline& pipeline) const {
  Draw whole = draw;
  whole.pipeline = &pipeline;
  return whole;
}

Frame upload(Backend& backend, const std::optional<MapTextures>& map, const UploadedScene& scene) {
  Frame frame{.draw = draw_of(scene, scene.frame)};
  if (!map) return frame;
  frame.relief = backend.upload(texture_desc(map->relief, scene.wrap));
  frame.draw.textures[kReliefMap] = frame.relief.get();
  if (!map->extra) return frame;
  frame.extra = backend.upload(texture_desc(*map->extra, scene.wrap));
  frame.draw.textures[kExtraMap] = frame.extra.get();
  return frame;
}

std::unique_ptr<Texture> upload_exact(Backend& backend, std::span<const ReferenceHit> hits, const FeatureValues& values,
                                      const FrameUniforms& frame) {
  // A pixel's t, then its features' values.
  const std::size_t channels = values.empty() ? 1 : kMostChannels;
  std::vector<float> texels(channels * hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    texels[channels * i] = static_cast<float>(hits[i].t_enter);
    for (std::size_t j = 0; j < values.size(); ++j) texels[channels * i + j + 1] = values[j][i];
  }
  return backend.upload({.width = frame.sizes[0],
                         .height = frame.sizes[1],
                         .layout = {.type = TexelType::float32, .channels = static_cast<int>(channels)},
                         .texels = std::as_bytes(std::span(texels)),
                         .wrap = Wrap::clamp,
                         .filter = Filter::nearest});
}

Draw reference_draw(const UploadedScene& scene, const Texture& exact, const FrameUniforms& frame) {
  Draw draw = draw_of(scene, frame);
  draw.textures[kReferenceMap] = &exact;
  return draw;
}

std::vector<Draw> passes_of(const Settings& settings, const Draw& relief, const Target& target) {
  const std::string_view count = settings.technique().passes;
  std::vector<Draw> draws(count.empty() ? 1 : static_cast<std::size_t>(settings.get(count)), relief);
  for (std::size_t i = 0; i < draws.size() && !count.empty(); ++i)
    draws[i].frame.argument() = static_cast<float>(target.has_depth ? draws.size() - 1 - i : i);
  return draws;
}

void PictureMean::add(std::span<const std::uint8_t> picture) {
  sums_.resize(picture.size());
  std::ranges::transform(sums_, picture, sums_.begin(), std::plus());
  ++count_;
}

void PictureMean::put_colors(std::span<std::uint8_t> picture) const {
  for (std::size_t i = 0; i < picture.size(); ++i)
    if (i % 4 != 3) picture[i] = static_cast<std::uint8_t>((sums_[i] + count_ / 2) / count_);
}

void trace_frame(Backend& backend, std::span<const Draw> frame, std::vector<ScorePixel>& into) {
  backend.render(frame, 1, Timer::fenced_wall);
  backend.read_score(into);
}

std::vector<ScorePixel> trace_frame(Backend& backend, std::span<const Draw> frame) {
  std::vector<ScorePixel> pixels;
  trace_frame(backend, frame, pixels);
  return pixels;
}

std::vector<ScorePixel> trace_frame(Backend& backend, const Draw& draw) {
  return trace_frame(backend, std::span(&draw, 1));
}

void shade_frame(Backend& backend, std::span<const Draw> frame, std::vector<std::uint8_t>& into) {
  backend.render(frame, 1, Timer::fenced_wall);
  backend.read_color(into);
}

std::vector<std::uint8_t> shade_frame(Backend& backend, std::span<const Draw> frame) {
  std::vector<std::uint8_t> rgba8;
  shade_frame(backend, frame, rgba8);
  return rgba8;
}

}  // namespace reliefbench
