#pragma once
#include <compare>
#include <string>
#include <string_view>

#include "kernels/image/heightmaps.h"
#include "tuner/plan/case.h"

namespace reliefbench {

/// As many digits of a hash as people are shown.
[[nodiscard]] inline std::string short_key(std::string_view hex) { return std::string(hex.substr(0, 8)); }

/// Longest side of a frame. px
inline constexpr int kFrameSideMax_px = 16384;

/// What a scene is, whatever it is called: a hash of its heights as read, the view's numbers, surface, relief depth,
/// tiling, pan, wrap, frame size and light. Records, presets and files match by it; a scene's id is for people.
struct SceneKey {
  std::string hex{};  ///< 64 lower-case hex digits; "": unknown, as in tables that were recorded without one

  [[nodiscard]] bool is_known() const { return !hex.empty(); }
  [[nodiscard]] std::string short_text() const { return short_key(hex); }
  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 takes the comparison with 0 inside for a pointer
  auto operator<=>(const SceneKey&) const = default;
};
/// heights_sha256: of the heights as read (LoadedHeights::sha256)
[[nodiscard]] SceneKey scene_key(std::string_view heights_sha256, const Scene& scene);
/// "": unknown. throws: Error(bad_input): neither that nor 64 hex digits
[[nodiscard]] SceneKey parse_scene_key(std::string_view hex);

/// A scene with what was read for it: all it takes to draw it again, and to tell whether something is the same scene.
struct MeasuredScene {
  SceneSpec spec;
  std::string heights_sha256;
  SceneKey key;
  int map_width = 0;  ///< of the heights in texels; 0: a run of before this was written
  int map_height = 0;
};
[[nodiscard]] MeasuredScene measured_scene(const SceneSpec& spec, const LoadedHeights& heights);

/// What a heightmap is called in scene ids where its config does not say: `rocks`, `fbm_32x32`, a file's stem.
[[nodiscard]] std::string heightmap_name(const HeightmapSpec& spec);
/// "rocks" of "rocks/grazing", "grazing" of it.
[[nodiscard]] std::string_view heightmap_part(std::string_view scene_id);
[[nodiscard]] std::string_view view_part(std::string_view scene_id);

}  // namespace reliefbench
