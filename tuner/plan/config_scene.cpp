#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/base/size.h"
#include "kernels/base/suggest.h"
#include "kernels/mesh/meshes.h"
#include "kernels/trace/surface.h"
#include "tuner/plan/config_reader.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {
namespace {

constexpr int kHeightmapSideMin = 2;      // texels: one cell of the bilinear surface
constexpr int kHeightmapSideMax = 16384;  // texels
constexpr double kPanMost = 1e3;          // sides of the unit square
constexpr std::array<std::string_view, 2> kImageOnly{"channel", "floor"};
constexpr std::array<std::string_view, 3> kProceduralOnly{"width", "height", "seed"};

/// A part of a scene id; the characters between such parts are those that ids, globs and links use otherwise.
bool is_name(std::string_view text) {
  return !text.empty() && text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-") ==
                              std::string_view::npos;
}

std::string read_name(const ConfigReader& reader, const JsonNode& node) {
  std::string name = reader.text(node);
  if (!is_name(name)) reader.fail(node, fmt::format("'{}' may hold letters, digits, '_', '.' and '-' only", name));
  return name;
}

bool contains(const std::vector<std::string_view>& list, std::string_view word) {
  return std::ranges::find(list, word) != list.end();
}

struct NamedHeightmap {
  std::string id;
  HeightmapSpec spec;
};

/// A procedural name, a known name, or a file that is there.
void resolve_source(const ConfigReader& reader, const JsonNode& node, const std::filesystem::path& folder,
                    HeightmapSpec& spec, bool procedural) {
  std::vector<std::string_view> names = ids_of(known_heightmaps());
  if (procedural || contains(names, spec.source)) return;
  const std::filesystem::path file = folder / spec.source;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    for (const std::string_view name : ids_of(procedurals())) names.push_back(name);
    reader.fail(node, fmt::format("'{}' is {}, and there is no file {}", spec.source, unknown_text(spec.source, names),
                                  file.string()));
  }
  spec.source = file.string();
}

NamedHeightmap read_heightmap(const ConfigReader& reader, const JsonNode& node, const std::filesystem::path& folder) {
  HeightmapSpec spec;
  const bool is_object = node.value.is_object();
  if (is_object) reader.check_object(node, "heightmap");
  const JsonNode& source = is_object ? reader.required(node, "source") : node;
  spec.source = reader.text(source);
  const bool procedural = contains(ids_of(procedurals()), spec.source);
  resolve_source(reader, source, folder, spec, procedural);

  if (is_object) {
    for (const std::string_view key : procedural ? std::span<const std::string_view>(kImageOnly) : kProceduralOnly)
      if (const JsonNode* child = node.find(key))
        reader.fail(*child, procedural ? "a procedural heightmap has no channels"
                                       : "only a procedural heightmap has a size and a seed");
    if (const JsonNode* channel = node.find("channel")) {
      spec.channel = reader.text(*channel);
      if (const std::vector<std::string_view> known(heightmap_channels().begin(), heightmap_channels().end());
          !contains(known, spec.channel))
        reader.fail(*channel, fmt::format("'{}' is {}", spec.channel, unknown_text(spec.channel, known)));
    }
    if (const JsonNode* floor = node.find("floor")) {
      spec.floor = reader.text(*floor);
      if (const std::vector<std::string_view> known(floor_channels().begin(), floor_channels().end());
          !contains(known, spec.floor))
        reader.fail(*floor, fmt::format("'{}' is {}", spec.floor, unknown_text(spec.floor, known)));
    }
    if (const JsonNode* invert = node.find("invert")) spec.invert = reader.flag(*invert);
    if (const JsonNode* normalise = node.find("normalise")) spec.normalise = reader.flag(*normalise);
    const auto side = [&](std::string_view key, int& value) {
      if (const JsonNode* child = node.find(key))
        value = static_cast<int>(reader.integer(*child, kHeightmapSideMin, kHeightmapSideMax));
    };
    side("width", spec.width);
    side("height", spec.height);
    if (const JsonNode* seed = node.find("seed"))
      spec.seed = static_cast<std::uint32_t>(reader.integer(*seed, 0, UINT32_MAX));
    if (const JsonNode* name = node.find("name")) return {.id = read_name(reader, *name), .spec = spec};
  }
  std::string id = heightmap_name(spec);
  if (!is_name(id)) reader.fail(source, fmt::format("'{}' can't stand in a case id; give a \"name\" beside it", id));
  return {.id = std::move(id), .spec = std::move(spec)};
}

View read_view(const ConfigReader& reader, const JsonNode& node) {
  const std::span<const View> presets = view_presets();
  const auto preset = [&](std::string_view id) { return std::ranges::find(presets, id, &View::id); };
  if (!node.value.is_object()) {
    const std::string id = reader.text(node);
    const auto found = preset(id);
    if (found == presets.end())
      reader.fail(node, fmt::format("view '{}' is {}", id, unknown_text(id, ids_of(presets))));
    return *found;
  }
  reader.check_object(node, "view");
  const JsonNode& id = reader.required(node, "id");
  View view;
  view.id = read_name(reader, id);
  if (preset(view.id) != presets.end())
    reader.fail(id, fmt::format("'{}' is a preset (take another id, or the preset's name alone)", view.id));
  if (const JsonNode* elevation = node.find("elevation_deg"))
    view.elevation_deg = reader.number(*elevation, {.low = -90, .high = 90});
  if (const JsonNode* distance = node.find("distance"))
    view.distance = reader.number(*distance, {.low = 0, .above_low = true});
  if (const JsonNode* fov = node.find("fov_deg"))
    view.fov_deg = reader.number(*fov, {.low = 0, .high = 179, .above_low = true});
  if (const JsonNode* azimuth = node.find("azimuth_deg"))
    view.azimuth_deg = reader.number(*azimuth, {.low = -360, .high = 360});
  return view;
}

/// {"id", "from", "to", "frames"}: a camera's way, at equal steps: views "id_1", "id_2", ...
std::vector<View> read_path(const ConfigReader& reader, const JsonNode& node) {
  constexpr int kFramesMost = 1000;
  reader.check_object(node, "path");
  const std::string id = read_name(reader, reader.required(node, "id"));
  const View from = read_view(reader, reader.required(node, "from"));
  const View to = read_view(reader, reader.required(node, "to"));
  const auto frames = static_cast<int>(reader.integer(reader.required(node, "frames"), 2, kFramesMost));
  std::vector<View> views;
  for (int i = 0; i < frames; ++i) {
    const auto between = [&](double View::*number) {
      return std::lerp(from.*number, to.*number, 1.0 * i / (frames - 1));
    };
    views.push_back({.id = fmt::format("{}_{}", id, i + 1),
                     .elevation_deg = between(&View::elevation_deg),
                     .distance = between(&View::distance),
                     .fov_deg = between(&View::fov_deg),
                     .azimuth_deg = between(&View::azimuth_deg)});
  }
  return views;
}

Light read_light(const ConfigReader& reader, const JsonNode& node) {
  reader.check_object(node, "light");
  Light light;
  if (const JsonNode* elevation = node.find("elevation_deg"))
    light.elevation_deg = reader.number(*elevation, {.low = -90, .high = 90});
  if (const JsonNode* azimuth = node.find("azimuth_deg"))
    light.azimuth_deg = reader.number(*azimuth, {.low = -360, .high = 360});
  if (const JsonNode* radius = node.find("angular_radius_deg"))
    light.angular_radius_deg = reader.number(*radius, {.low = 0, .high = 45});
  return light;
}

Picture read_picture(const ConfigReader& reader, const JsonNode& node) {
  const std::string text = reader.text(node);
  const auto* const found = std::ranges::find(kPictures, text, &PictureRow::id);
  if (found == kPictures.end())
    reader.fail(node, fmt::format("'{}' is {}", text, unknown_text(text, ids_of(kPictures))));
  return found->kind;
}

Wrap read_wrap(const ConfigReader& reader, const JsonNode& node) {
  const std::string text = reader.text(node);
  return reader.at(node, [&] { return find_wrap(text); });
}

/// The mesh that is named, or an OBJ file that is there; read, so that it is known to the bit.
void read_mesh(const ConfigReader& reader, const JsonNode& node, const std::filesystem::path& folder,
               Surface& surface) {
  const JsonNode* const mesh = node.find("mesh");
  const JsonNode* const segments = node.find("segments");
  if (mesh != nullptr) surface.mesh = reader.text(*mesh);
  if (find_named_mesh(surface.mesh) != nullptr) {
    if (segments != nullptr) surface.segments = static_cast<int>(reader.integer(*segments, 1, kMostSegments));
  } else {
    if (segments != nullptr) reader.fail(*segments, "an OBJ file has its own");
    const std::filesystem::path file = folder / surface.mesh;
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored))
      reader.fail(mesh != nullptr ? *mesh : node,
                  fmt::format("'{}' is {}, and there is no file {}", surface.mesh,
                              unknown_text(surface.mesh, ids_of(named_meshes())), file.string()));
    surface.mesh = file.string();
  }
  surface.sha256 = mesh_sha256(scene_mesh(surface.mesh, surface.segments));
}

/// A row's id, or {"kind", "round", "tube", "mesh", "segments"}.
Surface read_surface(const ConfigReader& reader, const JsonNode& node, const std::filesystem::path& folder) {
  const bool is_object = node.value.is_object();
  if (is_object) reader.check_object(node, "surface");
  const JsonNode& kind = is_object ? reader.required(node, "kind") : node;
  const std::string id = reader.text(kind);
  const SurfaceRow* const row = find_surface(id);
  if (row == nullptr) reader.fail(kind, fmt::format("'{}' is {}", id, unknown_text(id, ids_of(surfaces()))));
  Surface surface{.kind = row->kind};
  const auto number = [&](std::string_view key, bool is_its_own, double& value) {
    const JsonNode* const child = is_object ? node.find(key) : nullptr;
    if (child == nullptr) return;
    if (!is_its_own) reader.fail(*child, fmt::format("a {} has none", id));
    value = reader.number(*child, {.low = 0, .above_low = true});
  };
  number("round", row->has_round, surface.round);
  number("tube", row->has_tube, surface.tube);
  for (const char* key : {"mesh", "segments"})
    if (const JsonNode* const child = is_object ? node.find(key) : nullptr; child != nullptr && !row->has_mesh)
      reader.fail(*child, fmt::format("a {} has none", id));
  if (row->has_mesh) read_mesh(reader, node, folder, surface);
  return surface;
}

/// What a scene's id has of its surface.
std::string surface_part(const Surface& surface) {
  if (!is_curved(surface.kind)) return "";
  std::string part = fmt::format("_{}", surface_row(surface.kind).id);
  if (surface.kind != SurfaceKind::mesh) return part;
  std::string name = std::filesystem::path(surface.mesh).stem().string();
  for (char& letter : name)
    if (!is_name({&letter, 1})) letter = '_';
  return part + "_" + name;
}

Size read_frame_px(const ConfigReader& reader, const JsonNode& node) {
  if (node.value.is_string()) {
    const std::string id = reader.text(node);
    const FrameSize* const size = find_frame_size(id);
    if (size == nullptr) reader.fail(node, fmt::format("'{}' is {}", id, unknown_text(id, ids_of(kFrameSizes))));
    return {size->width_px, size->height_px};
  }
  if (!node.value.is_array() || node.children.size() != 2)
    reader.fail(node, fmt::format("expected [width, height], or one of {}", fmt::join(ids_of(kFrameSizes), ", ")));
  const auto side = [&](const JsonNode& child) { return static_cast<int>(reader.integer(child, 1, kFrameSideMax_px)); };
  return {side(node.children[0]), side(node.children[1])};
}

}  // namespace

std::vector<SceneSpec> read_scene(const ConfigReader& reader, const JsonNode& node,
                                  const std::filesystem::path& folder) {
  reader.check_object(node, "scene");
  const NamedHeightmap heightmap = read_heightmap(reader, reader.required(node, "heightmap"), folder);
  Scene scene;
  if (const JsonNode* depth = node.find("relief_depth")) scene.relief_depth = reader.number(*depth, {.low = 0});
  if (const JsonNode* tiling = node.find("tiling"))
    scene.tiling = reader.number(*tiling, {.low = 0, .above_low = true});
  if (const JsonNode* pan = node.find("pan")) scene.pan = reader.number(*pan, {.low = -kPanMost, .high = kPanMost});
  if (const JsonNode* wrap = node.find("wrap")) scene.wrap = read_wrap(reader, *wrap);
  if (const JsonNode* light = node.find("light")) scene.light = read_light(reader, *light);
  if (const JsonNode* reference = node.find("reference")) {
    scene.reference = read_picture(reader, *reference);
    if (picture_row(scene.reference).is_complete && is_solid(heightmap.spec))
      reader.fail(*reference, "the exact shadow of a solid is not traced");
  }
  const JsonNode* frame = node.find("frame_px");
  if (frame != nullptr) {
    const Size size = read_frame_px(reader, *frame);
    scene.width_px = size.width;
    scene.height_px = size.height;
  }
  if (const JsonNode* surface = node.find("surface")) {
    scene.surface = read_surface(reader, *surface, folder);
    if (const std::string reason = surface_fault(scene); !reason.empty()) reader.fail(*surface, reason);
  }
  const JsonNode* base = node.find("base");
  if (base != nullptr) scene.base = reader.number(*base, {.low = 0, .high = 1});
  std::vector<SceneSpec> scenes;
  std::vector<double> occluded = {0};
  if (const JsonNode* shares = node.find("occluded")) {
    occluded.clear();
    for (const JsonNode& share : reader.items(*shares)) occluded.push_back(reader.number(share, {.low = 0, .high = 1}));
  }
  const std::string based = scene.base == 1 ? "" : fmt::format("_base_{:g}", 100 * scene.base);
  const auto add = [&](View view) {
    scene.view = std::move(view);
    for (const std::string& reason : {base_fault(scene), camera_fault(scene)})
      if (!reason.empty()) reader.fail(base == nullptr ? node : *base, reason);
    for (const double share : occluded) {
      scene.occluded = share;
      const std::string hidden = share == 0 ? "" : fmt::format("_hidden_{:g}", 100 * share);
      scenes.push_back(
          {.id = fmt::format("{}/{}{}{}{}", heightmap.id, scene.view.id, surface_part(scene.surface), based, hidden),
           .heightmap = heightmap.spec,
           .scene = scene,
           .has_default_frame = frame == nullptr});
    }
  };
  for (const JsonNode& item : reader.items(reader.required(node, "views"))) {
    if (item.value.is_object() && item.find("from") != nullptr)
      for (View& view : read_path(reader, item)) add(std::move(view));
    else
      add(read_view(reader, item));
  }
  return scenes;
}

}  // namespace reliefbench
