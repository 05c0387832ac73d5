#pragma once
#include <vector>

#include "kernels/heightfield.h"
#include "kernels/technique.h"
#include "kernels/texel.h"
#include "kernels/view.h"
#include "tests/backend_rig.h"

namespace reliefbench {

/// A relief map as a technique samples it, and the surface that it then stands for.
struct StoredMap {
  TextureImage image;
  Heightfield surface;  ///< heights as stored
};

inline StoredMap store_map(const Settings& settings, const Heightfield& heights, Wrap wrap) {
  const Technique& technique = settings.technique();
  const bool has_format = technique.find("format") != nullptr;
  const Format& format = find_format(has_format ? settings.choice("format") : "r32f");
  const bool has_cones = technique.find("encoding") != nullptr;
  const Encoding& encoding = find_encoding(has_cones ? settings.choice("encoding") : "ratio");
  StoredMap stored{.image = {}, .surface = quantise_heights(heights, format.type)};
  const MapRow& row = find_map(technique.map);
  BakeRequest request{.heights = stored.surface, .wrap = wrap};
  if (has_cones) request.correction = row.corrections[static_cast<std::size_t>(settings.get("correction"))];
  if (row.has_search_steps) request.search_steps = settings.get("search_steps");
  stored.image = pack_texture(stored.surface, row.bake(request), format, encoding);
  return stored;
}

/// The score frame of a technique over a stored map.
inline std::vector<ScorePixel> trace_frame(const Rig& rig, const Settings& settings, const StoredMap& map,
                                           const Scene& scene) {
  std::vector<SpecConstant> constants = {{.id = 0, .value = scene.wrap == Wrap::clamp ? 1 : 0}};
  for (const Param& param : settings.technique().params)
    if (param.constant_id >= 0)
      constants.push_back({.id = static_cast<std::uint32_t>(param.constant_id), .value = settings.get(param.id)});
  const auto pipeline = rig.pipeline(compile_fragment(settings.technique().id, Target::score, rig.row.dialect),
                                     Target::score, constants, std::string(settings.technique().id));
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
