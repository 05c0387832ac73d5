#include "reports/viewer/pane.h"

#include <fmt/format.h>

#include "kernels/trace/surface.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {

std::string map_key(const Settings& settings, const SceneSpec& spec) {
  std::string key = fmt::format("{} depth={}", bake_text(settings, spec), spec.scene.relief_depth);
  for (const char* id : {"format", "encoding", "lod"})
    if (settings.active(id) != nullptr) key += fmt::format(" {}={}", id, settings.choice(id));
  return settings.technique().reads_map() ? key : fmt::format("none depth={}", spec.scene.relief_depth);
}

std::string picture_key(const Settings& settings, const SceneSpec& spec) {
  const Scene& scene = spec.scene;
  return fmt::format("{} {} {}/{}/{}/{} {} {}/{}/{}", setting_id(settings), map_key(settings, spec),
                     scene.view.azimuth_deg, scene.view.elevation_deg, scene.view.distance, scene.view.fov_deg,
                     fmt::format("{} {} {}", scene.tiling, scene.pan, scene.base), scene.light.azimuth_deg,
                     scene.light.elevation_deg, scene.light.angular_radius_deg) +
         (scene.occluded != 0 ? fmt::format(" hidden {}", scene.occluded) : "") + surface_text(scene.surface);
}

}  // namespace reliefbench
