#include "tuner/measure/trace_device.h"

#include <array>

namespace reliefbench {

BakedScene SceneBaker::bake(const Settings& settings, const SceneSpec& spec) {
  const Scene& scene = spec.scene;
  const bool has_map = settings.technique().reads_map();
  const Format& format = storage_of(settings).format;
  if (std::string text = bake_text(settings, spec); text != text_) {
    map_ = nullptr;  // large maps: not both at once
    tracer_ = nullptr;
    BakedMap map{.heights = quantise_heights(heights_, format.type)};
    if (has_map) map.values = map_of(settings).bake(bake_request(settings, map.heights, scene.wrap));
    map_ = std::make_shared<const BakedMap>(std::move(map));
    tracer_ = std::make_shared<const ReferenceTracer>(map_->heights, scene.wrap);
    text_ = std::move(text);
  }
  return {.map = map_,
          .tracer = tracer_,
          .textures = has_map ? map_textures(settings, *map_, scene.wrap, scene.relief_depth)
                              : pack_heights(map_->heights, format)};
}

TraceDevice::TraceDevice(const BackendRow& row, int index, WallSplit& split, bool is_timed)
    : session_(row, index, split, is_timed) {
  constexpr std::array kWhite{std::byte{255}, std::byte{255}, std::byte{255}, std::byte{255}};
  blank_ = session_.backend().upload({.width = 1, .height = 1, .texels = kWhite});
}

TraceDevice::Frame TraceDevice::frame(const Settings& settings, const BakedScene& baked, const Scene& scene,
                                      const Target& target) {
  Backend& backend = session_.backend();
  Frame frame{.relief = backend.upload(texture_desc(baked.textures.relief, scene.wrap)), .extra = {}, .draw = {}};
  if (baked.textures.extra) frame.extra = backend.upload(texture_desc(*baked.textures.extra, scene.wrap));
  frame.draw = {.pipeline = session_.pipeline(settings.technique().id, &settings, target, scene.wrap).pipeline.get(),
                .textures = {{kReliefMap, frame.relief.get()},
                             {kNormalMap, blank_.get()},
                             {kExtraMap, frame.extra ? frame.extra.get() : blank_.get()}},
                .frame = frame_uniforms(scene, baked.map->heights.width, baked.map->heights.height)};
  return frame;
}

std::vector<ScorePixel> TraceDevice::trace(const Frame& frame) {
  session_.backend().render(frame.draw, 1, Timer::fenced_wall);
  return session_.backend().read_score();
}

}  // namespace reliefbench
