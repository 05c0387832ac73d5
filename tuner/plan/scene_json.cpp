#include "tuner/plan/scene_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "kernels/image/image.h"
#include "kernels/mesh/meshes.h"
#include "kernels/trace/surface.h"

namespace reliefbench {
namespace {

using nlohmann::json;

bool is_procedural(const HeightmapSpec& spec) {
  const auto rows = procedurals();
  return std::ranges::find(rows, spec.source, &ProceduralRow::id) != rows.end();
}

/// Whether a value is of the type; any is JSON.
template <typename T>
bool fits(const json& value) {
  if constexpr (std::is_same_v<T, bool>) return value.is_boolean();
  if constexpr (std::is_integral_v<T>) return value.is_number_integer();
  if constexpr (std::is_floating_point_v<T>) return value.is_number();
  if constexpr (std::is_same_v<T, std::string>) return value.is_string();
  return true;
}

/// A member of the right type. throws: Error(bad_input)
template <typename T>
T member(const json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  if (!object.is_object() || found == object.end()) fail_input("'{}' is missing in a scene", key);
  if (!fits<T>(*found)) fail_input("'{}' of a scene is {}, of another type than it must be", key, found->dump());
  return found->get<T>();
}

HeightmapSpec parse_heightmap(const json& j) {
  HeightmapSpec spec{.source = member<std::string>(j, "source"),
                     .channel = member<std::string>(j, "channel"),
                     .invert = member<bool>(j, "invert"),
                     .normalise = member<bool>(j, "normalise")};
  if (j.contains("floor")) spec.floor = member<std::string>(j, "floor");
  if (!is_procedural(spec)) return spec;
  spec.width = member<int>(j, "width");
  spec.height = member<int>(j, "height");
  spec.seed = member<std::uint32_t>(j, "seed");
  return spec;
}

/// Absent where it is the usual one.
Light parse_light(const json& scene) {
  if (!scene.contains("light")) return {};
  const auto j = member<json>(scene, "light");
  return {.elevation_deg = member<double>(j, "elevation_deg"),
          .azimuth_deg = member<double>(j, "azimuth_deg"),
          .angular_radius_deg = member<double>(j, "angular_radius_deg")};
}

View parse_view(const json& j) {
  return {.id = member<std::string>(j, "id"),
          .elevation_deg = member<double>(j, "elevation_deg"),
          .distance = member<double>(j, "distance"),
          .fov_deg = member<double>(j, "fov_deg"),
          .azimuth_deg = member<double>(j, "azimuth_deg")};
}

/// Absent where it is the usual one.
Picture parse_picture(const json& scene) {
  if (!scene.contains("reference")) return Picture::point;
  const auto text = member<std::string>(scene, "reference");
  const auto* const found = std::ranges::find(kPictures, text, &PictureRow::id);
  if (found == kPictures.end()) fail_input("'reference' of a scene is '{}', which is no row of pictures", text);
  return found->kind;
}

/// Absent where it is a plane.
Surface parse_surface(const json& scene) {
  if (!scene.contains("surface")) return {};
  const auto j = member<json>(scene, "surface");
  const auto id = member<std::string>(j, "kind");
  const SurfaceRow* const row = find_surface(id);
  if (row == nullptr) fail_input("'surface' of a scene is '{}', none that is known", id);
  Surface surface{.kind = row->kind};
  if (row->has_round) surface.round = member<double>(j, "round");
  if (row->has_tube) surface.tube = member<double>(j, "tube");
  if (row->has_mesh) {
    surface.mesh = member<std::string>(j, "mesh");
    if (find_named_mesh(surface.mesh) != nullptr) surface.segments = member<int>(j, "segments");
    surface.sha256 = member<std::string>(j, "sha256");
  }
  return surface;
}

Wrap parse_wrap(const json& scene) {
  return find_row(kWrapRows, "'wrap' of a scene:", member<std::string>(scene, "wrap")).wrap;
}

/// [width, height], each from 1 to `most`.
bool is_pair_of(const json& sides, int most) {
  const auto is_side = [&](const json& side) { return side.is_number_integer() && side > 0 && side <= most; };
  return sides.is_array() && sides.size() == 2 && std::ranges::all_of(sides, is_side);
}

}  // namespace

json heightmap_json(const HeightmapSpec& spec) {
  json j = {{"source", spec.source}, {"channel", spec.channel}, {"invert", spec.invert}, {"normalise", spec.normalise}};
  if (!spec.floor.empty()) j["floor"] = spec.floor;
  if (is_procedural(spec)) j.update({{"width", spec.width}, {"height", spec.height}, {"seed", spec.seed}});
  return j;
}

json view_json(const View& view) {
  return {{"id", view.id},
          {"elevation_deg", view.elevation_deg},
          {"distance", view.distance},
          {"fov_deg", view.fov_deg},
          {"azimuth_deg", view.azimuth_deg}};
}

json light_json(const Light& light) {
  return {{"elevation_deg", light.elevation_deg},
          {"azimuth_deg", light.azimuth_deg},
          {"angular_radius_deg", light.angular_radius_deg}};
}

json surface_json(const Surface& surface) {
  const SurfaceRow& row = surface_row(surface.kind);
  json j = {{"kind", row.id}};
  if (row.has_round) j["round"] = surface.round;
  if (row.has_tube) j["tube"] = surface.tube;
  if (row.has_mesh) j["mesh"] = surface.mesh;
  if (row.has_mesh && find_named_mesh(surface.mesh) != nullptr) j["segments"] = surface.segments;
  return j;
}

json scene_json(const MeasuredScene& scene) {
  const Scene& s = scene.spec.scene;
  json j = {{"id", scene.spec.id},
            {"key", scene.key.hex},
            {"heights_sha256", scene.heights_sha256},
            {"heightmap", heightmap_json(scene.spec.heightmap)},
            {"view", view_json(s.view)},
            {"relief_depth", s.relief_depth},
            {"tiling", s.tiling},
            {"pan", s.pan},
            {"wrap", wrap_id(s.wrap)},
            {"frame_px", {s.width_px, s.height_px}}};
  if (s.light != Light{}) j["light"] = light_json(s.light);
  if (s.reference != Picture::point) j["reference"] = picture_id(s.reference);
  if (s.occluded != 0) j["occluded"] = s.occluded;
  if (s.base != 1) j["base"] = s.base;
  if (is_curved(s.surface.kind)) j["surface"] = surface_json(s.surface);
  if (s.surface.kind == SurfaceKind::mesh) j["surface"]["sha256"] = s.surface.sha256;
  if (scene.map_width > 0) j["heights_texels"] = {scene.map_width, scene.map_height};
  return j;
}

MeasuredScene parse_scene(const json& j) {
  const auto frame_px = member<json>(j, "frame_px");
  if (!is_pair_of(frame_px, kFrameSideMax_px))
    fail_input("'frame_px' of a scene is {}, not [width, height]", frame_px.dump());
  MeasuredScene scene{.spec = {.id = member<std::string>(j, "id"),
                               .heightmap = parse_heightmap(member<json>(j, "heightmap")),
                               .scene = {.view = parse_view(member<json>(j, "view")),
                                         .relief_depth = member<double>(j, "relief_depth"),
                                         .tiling = member<double>(j, "tiling"),
                                         .pan = member<double>(j, "pan"),
                                         .wrap = parse_wrap(j),
                                         .width_px = frame_px[0].get<int>(),
                                         .height_px = frame_px[1].get<int>(),
                                         .light = parse_light(j),
                                         .reference = parse_picture(j),
                                         .occluded = j.contains("occluded") ? member<double>(j, "occluded") : 0,
                                         .surface = parse_surface(j),
                                         .base = j.contains("base") ? member<double>(j, "base") : 1}},
                      .heights_sha256 = member<std::string>(j, "heights_sha256"),
                      .key = parse_scene_key(member<std::string>(j, "key"))};
  if (const auto sides = j.value("heights_texels", json::array()); !sides.empty()) {
    if (!is_pair_of(sides, kMaxSide))
      fail_input("'heights_texels' of a scene is {}, not [width, height]", sides.dump());
    scene.map_width = sides[0].get<int>();
    scene.map_height = sides[1].get<int>();
  }
  if (const SceneKey own = scene_key(scene.heights_sha256, scene.spec.scene); own != scene.key)
    fail_input("scene '{}' has the key {}, but what it says makes {}", scene.spec.id, scene.key.short_text(),
               own.short_text());
  return scene;
}

json scenes_json(std::span<const MeasuredScene> scenes) {
  json list = json::array();
  for (const MeasuredScene& scene : scenes) list.push_back(scene_json(scene));
  return list;
}

std::vector<MeasuredScene> parse_scenes(const json& list) {
  if (!list.is_array() && !list.is_null()) fail_input("expected a list of scenes");
  std::vector<MeasuredScene> scenes;
  for (const json& j : list) scenes.push_back(parse_scene(j));
  return joined_scenes({}, scenes, "");
}

const MeasuredScene* find_scene(std::span<const MeasuredScene> scenes, const SceneKey& key) {
  const auto found = std::ranges::find(scenes, key, &MeasuredScene::key);
  return found == scenes.end() ? nullptr : &*found;
}

std::string difference_text(const MeasuredScene& before, const MeasuredScene& now) {
  const auto traits = [](const MeasuredScene& scene) {
    const Scene& s = scene.spec.scene;
    const View& v = s.view;
    return std::vector<std::pair<std::string_view, std::string>>{
        {"heights", std::string(short_key(scene.heights_sha256))},
        {"view", fmt::format("{}/{}/{}/{}", v.elevation_deg, v.distance, v.fov_deg, v.azimuth_deg)},
        {"relief depth", fmt::format("{}", s.relief_depth)},
        {"tiling", fmt::format("{}", s.tiling)},
        {"pan", fmt::format("{}", s.pan)},
        {"wrap", std::string(wrap_id(s.wrap))},
        {"frame", fmt::format("{}x{}", s.width_px, s.height_px)},
        {"light", fmt::format("{}/{}/{}", s.light.elevation_deg, s.light.azimuth_deg, s.light.angular_radius_deg)},
        {"reference", std::string(picture_id(s.reference))},
        {"occluded", fmt::format("{}", s.occluded)},
        {"base", fmt::format("{}", s.base)},
        {"surface",
         fmt::format("{}{}", is_curved(s.surface.kind) ? surface_text(s.surface) : "plane",
                     s.surface.kind == SurfaceKind::mesh ? fmt::format(" ({})", short_key(s.surface.sha256)) : "")}};
  };
  const auto old = traits(before);
  const auto fresh = traits(now);
  std::string text;
  for (std::size_t i = 0; i < old.size(); ++i)
    if (const auto& [name, value] = old[i]; value != fresh[i].second)
      text += fmt::format("{}{} {}, now {}", text.empty() ? "" : "; ", name, value, fresh[i].second);
  return text;
}

std::vector<MeasuredScene> joined_scenes(std::span<const MeasuredScene> earlier, std::span<const MeasuredScene> now,
                                         std::string_view folder) {
  std::vector<MeasuredScene> all(earlier.begin(), earlier.end());
  for (const MeasuredScene& scene : now) {
    const auto known = std::ranges::find(all, scene.spec.id, [](const MeasuredScene& s) { return s.spec.id; });
    if (known == all.end()) {
      all.push_back(scene);
      continue;
    }
    if (known->key == scene.key) continue;
    const auto place = static_cast<std::size_t>(known - all.begin());
    if (place < earlier.size() && known->heights_sha256 != scene.heights_sha256)
      fail_input(
          "{}: scene '{}' was measured on the heights {}, {} now holds {}; put the heightmap back, or choose another "
          "folder to start anew",
          folder, scene.spec.id, short_key(known->heights_sha256), scene.spec.heightmap.source,
          short_key(scene.heights_sha256));
    if (place < earlier.size())
      fail_input("{}: scene '{}' is not the same: {}; choose another folder to start anew", folder, scene.spec.id,
                 difference_text(*known, scene));
    fail_input("two scenes are called '{}', {} and {}: {}", scene.spec.id, known->key.short_text(),
               scene.key.short_text(), difference_text(*known, scene));
  }
  return all;
}

}  // namespace reliefbench
