#include "reports/export/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>

#include "kernels/base/append_file.h"
#include "kernels/base/atomic_file.h"
#include "kernels/base/file_error.h"
#include "kernels/base/sha256.h"
#include "kernels/image/ktx2.h"
#include "reports/export/shipped_shader.h"
#include "tuner/measure/bake_job.h"
#include "tuner/measure/map_library.h"
#include "tuner/plan/scene_json.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/host.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::string_view kSettingsFile = "settings.json";
constexpr std::array<std::string_view, 4> kFileNames = {"relief.ktx2", "relief.extra.ktx2", "relief.glsl",
                                                        kSettingsFile};
constexpr std::string_view kMadeBy = "reliefbench ";

/// The files that an earlier export into the folder wrote, by its settings.json. Whatever else has such a name is
/// somebody's own.
std::set<std::string> earlier_files(const fs::path& folder) {
  std::set<std::string> names;
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(folder / kSettingsFile, error))) return names;
  const auto settings = nlohmann::json::parse(read_file(folder / kSettingsFile), nullptr, false);
  const auto text = [](const nlohmann::json& object, const char* key) {
    const auto found = object.is_object() ? object.find(key) : object.end();
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  if (!text(settings, "made_by").starts_with(kMadeBy) || !settings.contains("files")) return names;
  names.emplace(kSettingsFile);
  for (const nlohmann::json& file : settings.at("files"))
    if (const std::string name = text(file, "file"); std::ranges::find(kFileNames, name) != kFileNames.end())
      names.insert(name);
  return names;
}

struct Baked {
  int width = 0;
  int height = 0;
  std::string heights_sha256{};
  std::optional<MeasuredScene> scene{};
  std::optional<MapTextures> textures{};  ///< none: the technique reads no map
};

Baked bake_shipped(const ExportJob& job, Heightmaps heightmaps) {
  const Cache cache = Cache::open();
  WallSplit split;
  MapLibrary library(cache, split, std::move(heightmaps));
  const SceneSpec scene{.id = "export",
                        .heightmap = job.heightmap,
                        .scene = {.view = {}, .relief_depth = job.relief_depth, .wrap = job.wrap}};
  const LoadedHeights& heights = library.loaded(scene);
  Baked baked{.width = heights.field.width, .height = heights.field.height, .heights_sha256 = heights.sha256};
  if (job.scene) baked.scene = measured_scene(*job.scene, heights);
  baked.textures = library.packed(job.settings, scene);
  return baked;
}

ordered_json texture_json(const ShippedTexture& texture) {
  return {
      {"sampler", texture.sampler},      {"binding", texture.binding},      {"file", texture.file},
      {"format", texture.format},        {"channels", texture.channels},    {"width", texture.image->width},
      {"height", texture.image->height}, {"levels", texture.image->levels}, {"bytes", texture.image->texels.size()}};
}

ordered_json map_json(const ExportJob& job) {
  const MapStorage storage = storage_of(job.settings);
  return {{"kind", storage.map.id},
          {"correction", correction_id(storage.correction)},
          {"max_ratio", storage.max_ratio},
          {"format", storage.format.id},
          {"encoding", storage.encoding.id}};
}

ordered_json shipped_heightmap_json(const ExportJob& job, const Baked& baked) {
  ordered_json j = heightmap_json(job.heightmap);
  j["width"] = baked.width;
  j["height"] = baked.height;
  j["sha256"] = baked.heights_sha256;
  return j;
}

ordered_json settings_json(const ExportJob& job, const Baked& baked, const std::vector<ShippedTexture>& textures) {
  const Technique& technique = job.settings.technique();
  ordered_json params = ordered_json::object();
  for (const SettingValue& given : job.settings.written()) params[std::string(given.param.id)] = given.text();
  ordered_json json = {{"schema", kExportSchema},
                       {"made_by", fmt::format("{}{} ({})", kMadeBy, version(), git_sha())},
                       {"setting", setting_id(job.settings)},
                       {"technique", technique.id},
                       {"params", std::move(params)},
                       {"source", technique.source},
                       {"guarantee", guarantee_id(guarantee_of(job.settings))},
                       {"heightmap", shipped_heightmap_json(job, baked)},
                       {"wrap", job.wrap == Wrap::repeat ? "repeat" : "clamp"},
                       {"relief_depth", job.relief_depth},
                       {"scene", baked.scene ? scene_json(*baked.scene) : nlohmann::json()}};
  if (baked.textures) json["map"] = map_json(job);
  json["textures"] = ordered_json::array();
  for (const ShippedTexture& texture : textures) json["textures"].push_back(texture_json(texture));
  json["evidence"] = job.evidence;
  return json;
}

}  // namespace

Export make_export(const ExportJob& job, Heightmaps heightmaps) {
  if (const std::string reason = conflict(job.settings); !reason.empty()) fail_input("{}", reason);
  const Baked baked = bake_shipped(job, std::move(heightmaps));
  ShippedShader shader{
      .settings = job.settings, .heightmap = job.heightmap.source, .wrap = job.wrap, .relief_depth = job.relief_depth};
  Export result;
  if (baked.textures) {
    shader.textures = shipped_textures(job.settings, *baked.textures);
    const auto metadata = map_metadata(storage_of(job.settings), job.wrap);
    for (const ShippedTexture& texture : shader.textures)
      result.files.push_back({.name = texture.file,
                              .what = fmt::format("{}, binding {}: {}, {} x {}", texture.sampler, texture.binding,
                                                  texture.format, texture.image->width, texture.image->height),
                              .bytes = encode_ktx2({.image = *texture.image, .metadata = metadata})});
  }
  result.files.push_back({.name = "relief.glsl",
                          .what = "trace() of this setting, for OpenGL and Vulkan",
                          .bytes = shipped_shader(shader)});
  result.settings = settings_json(job, baked, shader.textures);
  result.settings["files"] = ordered_json::array();
  for (const ExportedFile& file : result.files)
    result.settings["files"].push_back(
        {{"file", file.name}, {"bytes", file.bytes.size()}, {"sha256", sha256(file.bytes)}});
  result.files.push_back({.name = std::string(kSettingsFile),
                          .what = "the setting, its map, what the choice rests on",
                          .bytes = result.settings.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n"});
  return result;
}

void write_export(const Export& exported, const fs::path& folder) {
  std::error_code error;
  const bool is_new = fs::create_directories(folder, error);
  if (error) fail_file(folder, "cannot be made", error.value());
  try {
    const std::set<std::string> earlier = earlier_files(folder);
    for (const ExportedFile& file : exported.files)
      if (const fs::file_status there = fs::symlink_status(folder / file.name, error);
          fs::is_directory(there) || (fs::exists(there) && !earlier.contains(file.name)))
        fail_input("{}: is not of an export; choose another folder", (folder / file.name).string());
    remove_stale_temporaries(folder);
    // All bytes are on disk before the first file is replaced. settings.json, which lists them, is the first, so that
    // an export that was killed half-way can be done again over what it left.
    std::vector<PendingFile> pending;
    for (const ExportedFile& file : exported.files) pending.emplace_back(folder / file.name, file.bytes);
    for (const std::string& name : earlier)
      if (std::ranges::find(exported.files, name, &ExportedFile::name) == exported.files.end())
        fs::remove(folder / name, error);
    for (std::size_t i = pending.size(); i-- > 0;) pending[i].commit();
  } catch (...) {
    if (is_new) fs::remove(folder, error);  // unless something is in it
    throw;
  }
}

}  // namespace reliefbench
