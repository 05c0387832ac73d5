#pragma once
#include <vector>

#include "kernels/image/heightfield.h"
#include "kernels/maps/texel.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"
#include "tests/backend_rig.h"
#include "tuner/measure/map_library.h"
#include "tuner/measure/session.h"

namespace reliefbench {

/// A relief map as a technique samples it, and the surface that it then stands for.
struct StoredMap {
  MapTextures textures;
  Heightfield surface;  ///< heights as stored
};

inline StoredMap store_map(const Settings& settings, const Heightfield& heights, Wrap wrap) {
  if (!settings.technique().reads_map())  // flat reads no map: any will do
    return {.textures = pack_heights(heights, find_format("r32f")), .surface = heights};
  BakedMap map{.heights = quantise_heights(heights, storage_of(settings).format.type)};
  map.values = map_of(settings).bake(bake_request(settings, map.heights, wrap));
  MapTextures textures = map_textures(settings, map, wrap, Scene{}.relief_depth);
  return {.textures = std::move(textures), .surface = std::move(map.heights)};
}

/// A technique's score pipeline; serves every map of any format and every view of one wrap.
inline std::unique_ptr<Pipeline> score_pipeline(const Rig& rig, const Settings& settings, Wrap wrap) {
  return rig.pipeline(compile_fragment(settings.technique().id, Target::score, rig.row.dialect), Target::score,
                      constants_of(&settings, wrap), std::string(settings.technique().id));
}

inline std::vector<ScorePixel> trace_frame(const Rig& rig, const Pipeline& pipeline, const StoredMap& map,
                                           const Scene& scene) {
  const auto relief = rig.backend->upload(texture_desc(map.textures.relief, scene.wrap));
  const auto extra = map.textures.extra ? rig.backend->upload(texture_desc(*map.textures.extra, scene.wrap)) : nullptr;
  const Draw draw{.pipeline = &pipeline,
                  .textures = rig.textures(relief.get(), extra.get()),
                  .frame = frame_uniforms(scene, map.surface.width, map.surface.height)};
  rig.backend->render(draw, 1, Timer::fenced_wall);
  return rig.backend->read_score();
}

/// The score frame of a technique over a stored map.
inline std::vector<ScorePixel> trace_frame(const Rig& rig, const Settings& settings, const StoredMap& map,
                                           const Scene& scene) {
  return trace_frame(rig, *score_pipeline(rig, settings, scene.wrap), map, scene);
}

/// Settings of a technique with some values other than the defaults.
inline Settings settings_of(std::string_view technique,
                            const std::vector<std::pair<std::string_view, std::string_view>>& values = {}) {
  Settings settings(find_technique(technique));
  for (const auto& [id, text] : values) settings.set(id, text);
  return settings;
}

}  // namespace reliefbench
