#pragma once
#include <vector>

#include "kernels/image/heightfield.h"
#include "kernels/image/heightmap.h"
#include "kernels/maps/texel.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"
#include "tests/backend_rig.h"
#include "tests/test_heightmap.h"
#include "tuner/measure/frame.h"
#include "tuner/measure/session.h"

namespace reliefbench {

inline const Heightfield& small_fbm() {
  static const Heightfield map = load_heightmap({.source = "fbm", .width = 32, .height = 32});
  return map;
}

/// A relief map as a technique samples it, and the surface that it then stands for.
struct StoredMap {
  MapTextures textures;
  Heightfield surface;  ///< heights as stored
};

/// heights: of a relief, they are a solid on the bottom plate to techniques of solids
inline StoredMap store_map(const Settings& settings, const Heightfield& heights, Wrap wrap) {
  if (settings.technique().is_of_solids() && !heights.is_solid())
    return store_map(settings, on_the_bottom(heights), wrap);
  if (!settings.technique().reads_map())  // flat reads no map: any will do
    return {.textures = pack_heights(heights, find_format("r32f")), .surface = heights};
  BakedMap map = bake(bake_spec(settings, wrap), heights);
  MapTextures textures = *pack(settings, map, Scene{.view = {}, .wrap = wrap});
  return {.textures = std::move(textures), .surface = std::move(map.heights)};
}

/// A technique's score pipeline; serves every map of any format and every view of one wrap.
inline std::unique_ptr<Pipeline> score_pipeline(const Rig& rig, const Settings& settings, Wrap wrap,
                                                const MapSampler& sampler = {},
                                                SurfaceKind surface = SurfaceKind::plane) {
  const std::vector<PixelFeature> features = frame_features(settings);
  const Target target = score_target(features);
  return rig.pipeline(compile_fragment(settings.technique().id, target, rig.row.dialect, features, surface), target,
                      constants_of(&settings, wrap, sampler), std::string(settings.technique().id));
}

/// settings: null where its technique has one pass
inline std::vector<ScorePixel> trace_frame(const Rig& rig, const Pipeline& pipeline, const StoredMap& map,
                                           const Scene& scene, const Settings* settings = nullptr) {
  const auto relief = rig.backend->upload(texture_desc(map.textures.relief, scene.wrap));
  const auto extra = map.textures.extra ? rig.backend->upload(texture_desc(*map.textures.extra, scene.wrap)) : nullptr;
  const Draw draw{.pipeline = &pipeline,
                  .textures = rig.textures(relief.get(), extra.get()),
                  .frame = frame_uniforms(scene, map.surface.width, map.surface.height)};
  return trace_frame(*rig.backend, settings == nullptr ? std::vector{draw} : passes_of(*settings, draw, Target::score));
}

/// The score frame of a technique over a stored map. A pipeline is compiled once for all frames of a rig.
inline std::vector<ScorePixel> trace_frame(const Rig& rig, const Settings& settings, const StoredMap& map,
                                           const Scene& scene, const MapSampler& sampler = {}) {
  std::string key = fmt::format("{} {}", settings.technique().id, static_cast<int>(scene.surface.kind));
  for (const PixelFeature& feature : frame_features(settings)) key += fmt::format(" {}", feature.row->id);
  for (const SpecConstant& constant : constants_of(&settings, scene.wrap, sampler))
    key += fmt::format(" {}={}", constant.id, constant.value);
  std::unique_ptr<Pipeline>& pipeline = rig.kept[key];
  if (!pipeline) pipeline = score_pipeline(rig, settings, scene.wrap, sampler, scene.surface.kind);
  return trace_frame(rig, *pipeline, map, scene, &settings);
}

/// Settings of a technique with some values other than the defaults.
inline Settings settings_of(std::string_view technique,
                            const std::vector<std::pair<std::string_view, std::string_view>>& values = {}) {
  Settings settings(find_technique(technique));
  for (const auto& [id, text] : values) settings.set(id, text);
  return settings;
}

}  // namespace reliefbench
