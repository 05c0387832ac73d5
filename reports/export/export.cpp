#include "reports/export/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <system_error>

#include "kernels/base/append_file.h"
#include "kernels/base/atomic_file.h"
#include "kernels/base/file_error.h"
#include "kernels/base/folder_lock.h"
#include "kernels/base/sha256.h"
#include "kernels/trace/view.h"
#include "reports/export/shipped_shader.h"
#include "tuner/measure/bake_job.h"
#include "tuner/measure/map_library.h"
#include "tuner/plan/scene_json.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/host.h"
#include "tuner/results/json_text.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::string_view kSettingsFile = "settings.json";
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
  const std::set<std::string> possible = all_export_names();
  for (const nlohmann::json& file : settings.at("files"))
    if (const std::string name = text(file, "file"); possible.contains(name)) names.insert(name);
  return names;
}

struct Baked {
  int width = 0;
  int height = 0;
  std::string heights_sha256{};
  std::optional<MeasuredScene> scene{};
  std::optional<MapTextures> textures{};  ///< none: the technique reads no map
  std::optional<TextureImage> normals{};  ///< where they were asked for
};

TextureImage normals_of(const Heightfield& heights, const ExportJob& job) {
  std::vector<std::uint8_t> rgba8 = normal_map(heights, job.wrap, job.relief_depth);
  const bool has_levels = job.settings.active("normals") != nullptr && !job.settings.is("normals", "base");
  const int levels = has_levels ? append_levels(rgba8, heights.width, heights.height) : 1;
  const auto bytes = std::as_bytes(std::span(rgba8));
  return {.width = heights.width,
          .height = heights.height,
          .layout = {.type = TexelType::unorm8, .channels = 4},
          .levels = levels,
          .texels = {bytes.begin(), bytes.end()}};
}

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
  if (job.choice.normal_map) baked.normals = normals_of(heights.field, job);
  return baked;
}

ordered_json texture_json(const EngineTexture& texture) {
  return {{"sampler", texture.sampler}, {"binding", texture.binding},   {"file", texture.file},
          {"format", texture.format},   {"channels", texture.channels}, {"width", texture.width},
          {"height", texture.height},   {"levels", texture.levels},     {"bytes", texture.bytes}};
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

ordered_json settings_json(const ExportJob& job, const Baked& baked, const std::vector<EngineTexture>& textures) {
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
                       {"wrap", wrap_id(job.wrap)},
                       {"relief_depth", job.relief_depth},
                       {"base", job.base},
                       {"scene", baked.scene ? scene_json(*baked.scene) : nlohmann::json()}};
  if (baked.textures) json["map"] = map_json(job);
  json["textures"] = ordered_json::array();
  for (const EngineTexture& texture : textures) json["textures"].push_back(texture_json(texture));
  json["evidence"] = job.evidence;
  return json;
}

/// As the measured frame has it, else the plain scene's.
float light_radius_of(const ExportJob& job) {
  return frame_uniforms(job.scene ? job.scene->scene : Scene{.view = {}}, 1, 1).light[3];
}

}  // namespace

Export make_export(const ExportJob& job, Heightmaps heightmaps) {
  for (const std::string& reason : {conflict(job.settings), heights_conflict(job.settings, is_solid(job.heightmap))})
    if (!reason.empty()) fail_input("{}", reason);
  if (!job.settings.technique().passes.empty())
    fail_input("{} is several draws a frame, not a function to ship; depth_slices finds the same hits in one",
               job.settings.technique().id);
  if (job.base != 1 && takes_curvature(job.settings))
    fail_input("a ray that bends starts on the surface: {} ships with base 1", setting_id(job.settings));
  if (job.base != 1 && job.settings.is("depth", "conservative"))
    fail_input("the relief over the plane is nearer than the plane: {} ships with base 1", setting_id(job.settings));
  if (is_by_compute(job.settings) && takes_derivatives(job.settings))
    fail_input("{}: its relief_trace takes derivatives, which compute shaders have none of (dispatch=compute)",
               setting_id(job.settings));
  ShippedShader shader{.settings = job.settings,
                       .heightmap = job.heightmap.source,
                       .wrap = job.wrap,
                       .relief_depth = job.relief_depth,
                       .base = job.base,
                       .light_radius = light_radius_of(job)};
  Export result;
  std::vector<std::string> ids = job.choice.engines;
  if (ids.empty()) ids.emplace_back(kPlainEngine);
  const auto can_have_it = [&](const std::string& id, const auto& make) {
    try {
      make(find_engine(id));
      return true;
    } catch (const Error& error) {
      if (!job.choice.leaves_out || error.code() != Exit::bad_input) throw;
      result.left_out.push_back(fmt::format("{}: {}", id, error.what()));
      return false;
    }
  };
  std::erase_if(ids, [&](const std::string& id) {
    return !can_have_it(id, [&](const Engine& engine) { check_recipe(engine, shader); });
  });
  const Baked baked = bake_shipped(job, std::move(heightmaps));
  if (baked.textures) shader.textures = shipped_textures(job.settings, *baked.textures);
  EngineSource source{.shader = shader, .normals = baked.normals ? &*baked.normals : nullptr};
  if (baked.textures) source.metadata = map_metadata(bake_spec(job.settings, job.wrap));
  std::vector<EngineTexture> textures;
  for (const std::string& id : ids)
    static_cast<void>(can_have_it(id, [&](const Engine& engine) {
      EngineFiles made = engine_files(engine, source, job.choice, id == kPlainEngine ? "" : id + "/");
      std::ranges::move(made.textures, std::back_inserter(textures));
      std::ranges::move(made.files, std::back_inserter(result.files));
    }));
  if (result.files.empty()) fail_input("{}", fmt::join(result.left_out, "; "));
  result.settings = settings_json(job, baked, textures);
  result.settings["files"] = ordered_json::array();
  for (const ExportedFile& file : result.files)
    result.settings["files"].push_back(
        {{"file", file.name}, {"bytes", file.bytes.size()}, {"sha256", sha256(file.bytes)}});
  result.files.push_back({.name = std::string(kSettingsFile),
                          .what = "the setting, its map, what the choice rests on",
                          .bytes = json_text(result.settings, 1) + "\n"});
  return result;
}

namespace {

/// A folder of an export's files as it stands: none that lies behind a link, where other people's files may be.
void check_folder(const fs::path& folder) {
  std::error_code error;
  const fs::file_status there = fs::symlink_status(folder, error);
  if (fs::exists(there) && !fs::is_directory(there))
    fail_input("{}: is not of an export; choose another folder", folder.string());
}

/// Makes the folders that the files lie in; those that were made go again, unless something is in them.
class MadeFolders {
 public:
  MadeFolders(const Export& exported, const fs::path& top) {
    make(top);
    for (const ExportedFile& file : exported.files) {
      fs::path folder = top;
      for (const fs::path& part : fs::path(file.name).parent_path()) {
        folder /= part;
        check_folder(folder);
        make(folder);
      }
    }
  }
  ~MadeFolders() {
    std::error_code ignored;
    for (std::size_t i = made_.size(); !is_kept_ && i-- > 0;) fs::remove(made_[i], ignored);
  }
  MadeFolders(const MadeFolders&) = delete;
  MadeFolders& operator=(const MadeFolders&) = delete;
  void keep() { is_kept_ = true; }

 private:
  void make(const fs::path& folder) {
    std::error_code error;
    if (fs::create_directories(folder, error)) made_.push_back(folder);
    if (error) fail_file(folder, "cannot be made", error.value());
  }
  std::vector<fs::path> made_;
  bool is_kept_ = false;
};

}  // namespace

void write_export(const Export& exported, const fs::path& folder) {
  std::error_code error;
  MadeFolders folders(exported, folder);
  const FolderLock lock(folder);
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
    if (std::ranges::find(exported.files, name, &ExportedFile::name) == exported.files.end()) {
      fs::remove(folder / name, error);
      for (fs::path part = fs::path(name).parent_path(); !part.empty(); part = part.parent_path())
        fs::remove(folder / part, error);  // unless something is in it
    }
  for (std::size_t i = pending.size(); i-- > 0;) pending[i].commit();
  folders.keep();
}

}  // namespace reliefbench
