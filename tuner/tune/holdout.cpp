#include "tuner/tune/holdout.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/error.h"
#include "tuner/plan/scene_json.h"

namespace reliefbench {
namespace {

bool has_name(std::span<const MeasuredScene> scenes, const std::string& id) {
  return std::ranges::any_of(scenes, [&](const MeasuredScene& scene) { return scene.spec.id == id; });
}

bool is_of_another_file(std::span<const MeasuredScene> earlier, const MeasuredScene& scene) {
  return std::ranges::any_of(earlier, [&](const MeasuredScene& other) {
    return other.spec.id == scene.spec.id && other.spec.heightmap.source != scene.spec.heightmap.source;
  });
}

std::string hash_name(const MeasuredScene& scene) {
  const std::string_view name = heightmap_part(scene.spec.id);
  const std::string hash = short_key(scene.heights_sha256);
  if (name.ends_with("." + hash)) return scene.spec.id;
  return fmt::format("{}.{}/{}", name, hash, view_part(scene.spec.id));
}

}  // namespace

std::vector<MeasuredScene> named_holdout(std::span<const MeasuredScene> asked, std::span<const MeasuredScene> tuned,
                                         std::span<const MeasuredScene> earlier) {
  std::vector<MeasuredScene> named;
  for (MeasuredScene scene : asked) {
    if (const MeasuredScene* const same = find_scene(tuned, scene.key))
      fail_input("--holdout {}: is what the pick is tuned on (scene '{}')", scene.spec.heightmap.source, same->spec.id);
    if (find_scene(named, scene.key) != nullptr) continue;
    if (const MeasuredScene* const before = find_scene(earlier, scene.key))
      scene.spec.id = before->spec.id;
    else if (has_name(tuned, scene.spec.id) || has_name(named, scene.spec.id) || is_of_another_file(earlier, scene))
      scene.spec.id = hash_name(scene);
    named.push_back(std::move(scene));
  }
  return named;
}

}  // namespace reliefbench
