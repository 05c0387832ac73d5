#include "reports/export/export.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <optional>
#include <string_view>
#include <system_error>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "kernels/image/ktx2.h"
#include "reports/export/shipped_shader.h"
#include "tuner/measure/bake.h"
#include "tuner/measure/map_library.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/host.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::array<std::string_view, 4> kFileNames = {"relief.ktx2", "relief.extra.ktx2", "relief.glsl",
                                                        "settings.json"};

struct Baked {
  int width = 0;
  int height = 0;
  std::optional<MapTextures> textures{};  ///< none: the technique reads no map
};

Baked bake(const ExportJob& job) {
  const Cache cache = Cache::open();
  WallSplit split;
  MapLibrary library(cache, split);
  const Case c{.settings = job.settings, .scene_id = "export", .backend = {}};
  const SceneSpec scene{.id = c.scene_id,
                        .heightmap = job.heightmap,
                        .scene = {.view = {}, .relief_depth = job.relief_depth, .wrap = job.wrap}};
  const Heightfield& heights = library.heights(scene);
  Baked baked{.width = heights.width, .height = heights.height};
  if (job.settings.technique().reads_map())
    baked.textures = map_textures(job.settings, library.map(c, scene), job.wrap, job.relief_depth);
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

ordered_json settings_json(const ExportJob& job, const Baked& baked, const std::vector<ShippedTexture>& textures) {
  const Technique& technique = job.settings.technique();
  ordered_json params = ordered_json::object();
  for (const SettingValue& given : job.settings.written()) params[std::string(given.param.id)] = given.text();
  ordered_json json = {
      {"schema", kExportSchema},
      {"made_by", fmt::format("reliefbench {} ({})", version(), git_sha())},
      {"setting", setting_id(job.settings)},
      {"technique", technique.id},
      {"params", std::move(params)},
      {"source", technique.source},
      {"guarantee", guarantee_id(guarantee_of(job.settings))},
      {"heightmap", {{"source", job.heightmap.source}, {"width", baked.width}, {"height", baked.height}}},
      {"wrap", job.wrap == Wrap::repeat ? "repeat" : "clamp"},
      {"relief_depth", job.relief_depth}};
  if (baked.textures) json["map"] = map_json(job);
  json["textures"] = ordered_json::array();
  for (const ShippedTexture& texture : textures) json["textures"].push_back(texture_json(texture));
  json["evidence"] = job.evidence;
  return json;
}

}  // namespace

Export make_export(const ExportJob& job) {
  if (const std::string reason = conflict(job.settings); !reason.empty()) fail_input("{}", reason);
  const Baked baked = bake(job);
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
  result.files.push_back({.name = "settings.json",
                          .what = "the setting, its map, what the choice rests on",
                          .bytes = result.settings.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n"});
  return result;
}

void write_export(const Export& exported, const fs::path& folder) {
  std::error_code error;
  const bool is_new = fs::create_directories(folder, error);
  if (error) fail_input("{}: cannot be made: {}", folder.string(), error.message());
  for (const std::string_view name : kFileNames)
    if (fs::is_directory(folder / name, error)) fail_input("{}: is a folder", (folder / name).string());
  const fs::path stage = folder / fmt::format(".export.tmp{}", ::getpid());
  try {
    fs::create_directory(stage, error);
    if (error) fail_input("{}: cannot be written: {}", folder.string(), error.message());
    for (const ExportedFile& file : exported.files) write_atomically(stage / file.name, file.bytes);
    for (const std::string_view name : kFileNames) {
      if (fs::exists(stage / name))
        fs::rename(stage / name, folder / name, error);
      else
        fs::remove(folder / name, error);
      if (error) fail_input("{}: cannot be written: {}", (folder / name).string(), error.message());
    }
  } catch (...) {
    fs::remove_all(is_new ? folder : stage, error);
    throw;
  }
  fs::remove(stage, error);
}

}  // namespace reliefbench
