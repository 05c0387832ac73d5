#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "kernels/trace/technique.h"
#include "reports/export/engine.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {

inline constexpr int kExportSchema = 3;

/// What ships: one setting for one heightmap.
struct ExportJob {
  HeightmapSpec heightmap;
  Settings settings;
  Wrap wrap = Wrap::repeat;
  double relief_depth = 0.1;          ///< in sides of one tile
  double base = 1;                    ///< Scene::base
  std::optional<SceneSpec> scene{};   ///< the whole scene, where there is more to it than what ships
  nlohmann::json evidence = nullptr;  ///< what the choice rests on, for settings.json; null: the user said so
  ExportChoice choice{};
};

/// Everything that an engine needs, and nothing that needs reliefbench.
struct Export {                     // NOLINT(bugprone-exception-escape): moving a json does not throw
  nlohmann::ordered_json settings;  ///< settings.json
  /// those of each engine in a folder of its id, of the plain one beside settings.json, which comes last
  std::vector<ExportedFile> files;
  std::vector<std::string> left_out{};  ///< of each engine that cannot have it, why
};

/// Loads the heightmap, bakes its map (or has it from the cache) and makes the files.
/// throws: Error(bad_input): settings that make no sense together, an unreadable heightmap, what engine_files() says
/// heightmaps: what has been read already
[[nodiscard]] Export make_export(const ExportJob& job, Heightmaps heightmaps = {});

/// Writes all files whole, or none. Those of an earlier export in the folder are replaced, others left alone.
/// throws: Error(bad_input): unwritable
void write_export(const Export& exported, const std::filesystem::path& folder);

}  // namespace reliefbench
