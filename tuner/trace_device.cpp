#include "tuner/trace_device.h"

#include <array>

namespace reliefbench {

BakedScene bake_scene(const Settings& settings, const Heightfield& heights, const Scene& scene) {
  const bool has_map = settings.technique().find("format") != nullptr;  // flat reads none
  const Format& format = find_format(has_map ? settings.choice("format") : "r32f");
  BakedMap map{.heights = quantise_heights(heights, format.type)};
  MapTextures textures;
  if (has_map) {
    map.values = map_of(settings).bake(bake_request(settings, map.heights, scene.wrap));
    textures = map_textures(settings, map, scene.wrap, scene.relief_depth);
  } else {
    textures = pack_heights(map.heights, format);
  }
  ReferenceTracer tracer(map.heights, scene.wrap);
  return {.map = std::move(map), .textures = std::move(textures), .tracer = std::move(tracer)};
}

TraceDevice::TraceDevice(const BackendRow& row, int index, WallSplit& split, bool is_timed)
    : session_(row, index, split, is_timed) {
  constexpr std::array kWhite{std::byte{255}, std::byte{255}, std::byte{255}, std::byte{255}};
  blank_ = session_.backend().upload({.width = 1, .height = 1, .texels = kWhite});
}

TraceDevice::Frame TraceDevice::frame(const Settings& settings, const BakedScene& baked, const Scene& scene,
                                      Target target) {
  Backend& backend = session_.backend();
  Frame frame{.relief = backend.upload(texture_desc(baked.textures.relief, scene.wrap)), .extra = {}, .draw = {}};
  if (baked.textures.extra) frame.extra = backend.upload(texture_desc(*baked.textures.extra, scene.wrap));
  frame.draw = {.pipeline = session_.pipeline(settings.technique().id, &settings, target, scene.wrap).pipeline.get(),
                .relief = frame.relief.get(),
                .normals = blank_.get(),
                .reference = blank_.get(),
                .extra = frame.extra ? frame.extra.get() : blank_.get(),
                .frame = frame_uniforms(scene, baked.map.heights.width, baked.map.heights.height)};
  return frame;
}

std::vector<ScorePixel> TraceDevice::trace(const Frame& frame) {
  session_.backend().render(frame.draw, 1, Timer::fenced_wall);
  return session_.backend().read_score();
}

}  // namespace reliefbench
