#include "tuner/plan/scene_key.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "kernels/trace/surface.h"

namespace reliefbench {
namespace {

constexpr std::string_view kLayout = "scene 1";                       // of the text that is hashed
constexpr double positive_zero(double value) { return value + 0.0; }  // -0 is 0

}  // namespace

SceneKey scene_key(std::string_view heights_sha256, const Scene& scene) {
  // Bound by name, so that a field which is added does not compile before it is thought of here.
  const auto& [view, relief_depth, tiling, pan, wrap, width_px, height_px, light, reference, occluded, surface, base] =
      scene;
  const auto& [name, elevation_deg, distance, fov_deg, azimuth_deg] = view;
  static_cast<void>(name);  // for people
  std::string text = fmt::format("{}|{}|{}|{}x{}|{}", kLayout, heights_sha256, surface_row(surface.kind).id, width_px,
                                 height_px, wrap_id(wrap));
  for (const double number : {relief_depth, tiling, pan, elevation_deg, distance, fov_deg, azimuth_deg})
    text += fmt::format("|{}", positive_zero(number));
  const auto& [light_elevation_deg, light_azimuth_deg, light_radius_deg] = light;
  if (light != Light{})  // keys of before there was another
    for (const double number : {light_elevation_deg, light_azimuth_deg, light_radius_deg})
      text += fmt::format("|{}", positive_zero(number));
  if (reference != Picture::point) text += fmt::format("|{}", picture_id(reference));
  if (occluded != 0) text += fmt::format("|occluded {}", occluded);
  if (base != 1) text += fmt::format("|base {}", positive_zero(base));
  if (surface.kind == SurfaceKind::mesh)
    text += fmt::format("|{}", surface.sha256);  // whatever it is called
  else if (is_curved(surface.kind))
    text += fmt::format("|{}", surface_text(surface));
  return {.hex = sha256(text)};
}

SceneKey parse_scene_key(std::string_view hex) {
  constexpr std::size_t kDigits = 64;
  if (!hex.empty() && (hex.size() != kDigits || hex.find_first_not_of("0123456789abcdef") != std::string_view::npos))
    fail_input("'{}' is no scene key: expected {} hex digits", hex.substr(0, kDigits), kDigits);
  return {.hex = std::string(hex)};
}

MeasuredScene measured_scene(const SceneSpec& spec, const LoadedHeights& heights) {
  return {.spec = spec,
          .heights_sha256 = heights.sha256,
          .key = scene_key(heights.sha256, spec.scene),
          .map_width = heights.field.width,
          .map_height = heights.field.height};
}

std::string heightmap_name(const HeightmapSpec& spec) {
  const auto rows = procedurals();
  if (std::ranges::find(rows, spec.source, &ProceduralRow::id) == rows.end())
    return std::filesystem::path(spec.source).stem().string();
  const HeightmapSpec usual;
  if (spec.width == usual.width && spec.height == usual.height) return spec.source;
  return fmt::format("{}_{}x{}", spec.source, spec.width, spec.height);
}

std::string_view heightmap_part(std::string_view scene_id) { return scene_id.substr(0, scene_id.find('/')); }

std::string_view view_part(std::string_view scene_id) {
  const std::size_t slash = scene_id.find('/');
  return slash == std::string_view::npos ? std::string_view() : scene_id.substr(slash + 1);
}

}  // namespace reliefbench
