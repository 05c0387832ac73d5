#include "tuner/measure/frame.h"

#include <span>

#include "kernels/image/heightmap.h"

namespace reliefbench {

std::optional<MapTextures> pack(const Settings& settings, const BakedMap& map, const Scene& scene) {
  if (!settings.technique().reads_map()) return std::nullopt;
  const MapStorage storage = storage_of(settings);
  return pack_map({.map = storage.map,
                   .heights = map.heights,
                   .values = map.values,
                   .wrap = scene.wrap,
                   .relief_depth = scene.relief_depth,
                   .mips = reads_levels(settings)},
                  storage.format, storage.encoding);
}

UploadedScene upload(Backend& backend, const Scene& scene, const Heightfield& heights) {
  const std::vector<std::uint8_t> normals = normal_map(heights, scene.wrap, scene.relief_depth);
  return {.normals = backend.upload({.width = heights.width,
                                     .height = heights.height,
                                     .texels = std::as_bytes(std::span(normals)),
                                     .wrap = scene.wrap}),
          .wrap = scene.wrap,
          .frame = frame_uniforms(scene, heights.width, heights.height)};
}

Draw Frame::with(const Pipeline& pipeline) const {
  Draw whole = draw;
  whole.pipeline = &pipeline;
  return whole;
}

Frame upload(Backend& backend, const std::optional<MapTextures>& map, const UploadedScene& scene) {
  const Texture* const normals = scene.normals.get();  // any texture where the map has none
  Frame frame{
      .draw = {.textures = {{kReliefMap, normals}, {kNormalMap, normals}, {kExtraMap, normals}}, .frame = scene.frame}};
  if (!map) return frame;
  frame.relief = backend.upload(texture_desc(map->relief, scene.wrap));
  frame.draw.textures[kReliefMap] = frame.relief.get();
  if (!map->extra) return frame;
  frame.extra = backend.upload(texture_desc(*map->extra, scene.wrap));
  frame.draw.textures[kExtraMap] = frame.extra.get();
  return frame;
}

void trace_frame(Backend& backend, const Draw& draw, std::vector<ScorePixel>& into) {
  backend.render(draw, 1, Timer::fenced_wall);
  backend.read_score(into);
}

std::vector<ScorePixel> trace_frame(Backend& backend, const Draw& draw) {
  std::vector<ScorePixel> pixels;
  trace_frame(backend, draw, pixels);
  return pixels;
}

void shade_frame(Backend& backend, const Draw& draw, std::vector<std::uint8_t>& into) {
  backend.render(draw, 1, Timer::fenced_wall);
  backend.read_color(into);
}

std::vector<std::uint8_t> shade_frame(Backend& backend, const Draw& draw) {
  std::vector<std::uint8_t> rgba8;
  shade_frame(backend, draw, rgba8);
  return rgba8;
}

}  // namespace reliefbench
