#pragma once
#include <vector>

#include "kernels/heightfield.h"
#include "kernels/technique.h"
#include "kernels/texel.h"
#include "kernels/view.h"
#include "tests/backend_rig.h"
#include "tuner/map_library.h"
#include "tuner/session.h"

namespace reliefbench {

/// A relief map as a technique samples it, and the surface that it then stands for.
struct StoredMap {
  TextureImage image;
  Heightfield surface;  ///< heights as stored
};

inline StoredMap store_map(const Settings& settings, const Heightfield& heights, Wrap wrap) {
  const Technique& technique = settings.technique();
  if (technique.find("format") == nullptr) {  // flat reads no map: any will do
    const Format& format = find_format("r32f");
    return {.image = pack_texture(heights, {}, format, find_encoding("ratio")), .surface = heights};
  }
  StoredMap stored{.image = {}, .surface = quantise_heights(heights, find_format(settings.choice("format")).type)};
  const std::vector<float> ratios = find_map(technique.map).bake(bake_request(settings, stored.surface, wrap));
  stored.image = relief_texture(settings, stored.surface, ratios);
  return stored;
}

/// The score frame of a technique over a stored map.
inline std::vector<ScorePixel> trace_frame(const Rig& rig, const Settings& settings, const StoredMap& map,
                                           const Scene& scene) {
  const auto pipeline =
      rig.pipeline(compile_fragment(settings.technique().id, Target::score, rig.row.dialect), Target::score,
                   constants_of(&settings, scene.wrap), std::string(settings.technique().id));
  const auto texture = rig.backend->upload({.width = map.image.width,
                                            .height = map.image.height,
                                            .format = map.image.format,
                                            .texels = map.image.texels,
                                            .wrap = scene.wrap});
  const Draw draw{.pipeline = pipeline.get(),
                  .relief = texture.get(),
                  .normals = rig.plain.get(),
                  .reference = rig.plain.get(),
                  .frame = frame_uniforms(scene, map.image.width, map.image.height)};
  rig.backend->render(draw, 1, Timer::fenced_wall);
  return rig.backend->read_score();
}

/// Settings of a technique with some values other than the defaults.
inline Settings settings_of(std::string_view technique,
                            const std::vector<std::pair<std::string_view, std::string_view>>& values = {}) {
  Settings settings(find_technique(technique));
  for (const auto& [id, text] : values) settings.set(id, text);
  return settings;
}

}  // namespace reliefbench
