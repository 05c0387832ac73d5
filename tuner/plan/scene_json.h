#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/plan/scene_key.h"

namespace reliefbench {

/// A whole scene as run.json, presets.json and settings.json hold it: {"id", "key", "heights_sha256", "heightmap":
/// {...}, "view": {...}, "relief_depth", "tiling", "pan", "wrap", "frame_px": [width, height]} and, unless it is the
/// usual one, "light": {...}.
[[nodiscard]] nlohmann::json scene_json(const MeasuredScene& scene);
/// How a heightmap is read: {"source", "channel", "invert", "normalise"} and, of a procedural one, "width", "height",
/// "seed".
[[nodiscard]] nlohmann::json heightmap_json(const HeightmapSpec& spec);
[[nodiscard]] nlohmann::json view_json(const View& view);
[[nodiscard]] nlohmann::json light_json(const Light& light);
/// {"kind", "round"} and, of a torus, "tube".
[[nodiscard]] nlohmann::json surface_json(const Surface& surface);

/// throws: Error(bad_input): not such an object, or its key is not that of what it says
[[nodiscard]] MeasuredScene parse_scene(const nlohmann::json& j);

[[nodiscard]] nlohmann::json scenes_json(std::span<const MeasuredScene> scenes);
[[nodiscard]] std::vector<MeasuredScene> parse_scenes(const nlohmann::json& list);  ///< null: none. throws: as above

/// The scene of that key; null: none.
[[nodiscard]] const MeasuredScene* find_scene(std::span<const MeasuredScene> scenes, const SceneKey& key);

/// What tells one scene from another, for people: "relief depth 0.1, now 0.2; frame 256x256, now 128x128".
[[nodiscard]] std::string difference_text(const MeasuredScene& before, const MeasuredScene& now);

/// The scenes of an earlier start, and those of this one that are new.
/// folder: for messages
/// throws: Error(bad_input): a scene of this start, or of both, is another than one of the same name: with both named
[[nodiscard]] std::vector<MeasuredScene> joined_scenes(std::span<const MeasuredScene> earlier,
                                                       std::span<const MeasuredScene> now, std::string_view folder);

}  // namespace reliefbench
