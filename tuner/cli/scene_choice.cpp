#include "tuner/cli/scene_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "tuner/cli/options.h"

namespace reliefbench {
namespace {

using Scenes = std::vector<MeasuredScene>;

/// HEIGHTMAP, read as the scene's own was.
HeightmapSpec read_as(const MeasuredScene& scene, const SettingArguments& arguments) {
  HeightmapSpec spec = scene.spec.heightmap;
  const bool is_its_name = arguments.heightmap.empty() || arguments.heightmap == heightmap_part(scene.spec.id);
  if (!is_its_name) spec.source = arguments.heightmap;
  set_reading(spec, arguments.reading);
  return spec;
}

std::string ids(const Scenes& scenes) {
  std::vector<std::string> list;
  for (const MeasuredScene& scene : scenes) list.push_back(scene.spec.id);
  return fmt::format("{}", fmt::join(list, ", "));
}

/// Those that --scene means.
Scenes named(const Scenes& all, const std::string& name) {
  Scenes kept;
  for (const MeasuredScene& scene : all)
    if (name.empty() || scene.spec.id == name) kept.push_back(scene);
  if (kept.empty()) fail_input("--scene {}: the setting was measured in {}", name, ids(all));
  return kept;
}

/// Those whose heights HEIGHTMAP holds, with it as their heightmap.
Scenes of_heightmap(const Scenes& scenes, const SettingArguments& arguments, Heightmaps& heightmaps) {
  std::set<std::string> names;
  std::set<std::string> hashes;
  for (const MeasuredScene& scene : scenes) {
    names.emplace(heightmap_part(scene.spec.id));
    hashes.insert(scene.heights_sha256);
  }
  if (arguments.heightmap.empty() && hashes.size() > 1)
    fail_input("the setting was measured on {} heightmaps, say which: {}", hashes.size(), fmt::join(names, ", "));

  Scenes kept;
  std::string refusal;
  std::string found;  // hash of what HEIGHTMAP holds, as it was read last
  for (MeasuredScene scene : scenes) {
    scene.spec.heightmap = read_as(scene, arguments);
    try {
      found = heightmaps.read(scene.spec.heightmap).sha256;
      if (found == scene.heights_sha256) kept.push_back(std::move(scene));
    } catch (const Error& error) {  // it may be another scene's
      refusal = error.what();
    }
  }
  if (!kept.empty()) return kept;
  if (arguments.other_heightmap && !arguments.heightmap.empty()) {
    Scenes others = scenes;
    for (MeasuredScene& scene : others) scene.spec.heightmap = told_heightmap(arguments);
    static_cast<void>(heightmaps.read(others.front().spec.heightmap));
    return others;
  }
  if (found.empty()) fail_input("{}", refusal);
  const MeasuredScene& first = scenes.front();
  fail_input("{} holds the heights {}, but the setting was measured on {} ({}){}",
             arguments.heightmap.empty() ? first.spec.heightmap.source : arguments.heightmap, short_key(found),
             fmt::join(names, ", "), short_key(first.heights_sha256),
             arguments.heightmap.empty() ? "; name a HEIGHTMAP with --other-heightmap to take it all the same"
                                         : "; --other-heightmap takes it all the same");
}

const MeasuredScene& one_of(const Scenes& scenes, const SettingArguments& arguments, bool needs_view) {
  if (arguments.view) {
    const auto same_view =
        std::ranges::find(scenes, *arguments.view, [](const auto& s) { return s.spec.scene.view.id; });
    if (same_view != scenes.end()) return *same_view;
  }
  const Scene& first = scenes.front().spec.scene;
  const bool is_one = std::ranges::all_of(scenes, [&](const MeasuredScene& scene) {
    const Scene& s = scene.spec.scene;
    return s.relief_depth == first.relief_depth && s.base == first.base && s.wrap == first.wrap &&
           (!needs_view || s.tiling == first.tiling);
  });
  if (!is_one)
    fail_input(
        "the setting was measured in scenes that differ in relief depth, base, tiling or wrap, choose one by --scene: "
        "{}",
        ids(scenes));
  return scenes.front();
}

void set_view(Scene& scene, const std::string& id) {
  for (const View& view : view_presets())
    if (view.id == id) scene.view = view;
}

/// What the command line says goes before.
void apply(const SettingArguments& arguments, Scene& scene) {
  if (arguments.wrap) scene.wrap = find_wrap(*arguments.wrap);
  if (arguments.relief_depth) scene.relief_depth = *arguments.relief_depth;
  if (arguments.base) scene.base = *arguments.base;
  if (arguments.tiling) scene.tiling = *arguments.tiling;
  if (arguments.view && scene.view.id != *arguments.view) set_view(scene, *arguments.view);
  if (!arguments.size_px.empty()) {
    scene.width_px = arguments.size_px.at(0);
    scene.height_px = arguments.size_px.at(1);
  }
  if (const std::string reason = base_fault(scene); !reason.empty()) fail_input("--base: {}", reason);
}

/// Of a name that a config gives by itself: "rocks", "fbm", "fbm_32x32".
std::optional<HeightmapSpec> heightmap_called(std::string_view name) {
  for (const KnownHeightmapRow& row : known_heightmaps())
    if (row.id == name) return HeightmapSpec{.source = std::string(name)};
  for (const ProceduralRow& row : procedurals()) {
    HeightmapSpec spec{.source = std::string(row.id)};
    if (name.starts_with(row.id) && name.substr(row.id.size()).starts_with('_')) try {
        set_size(spec, std::string(name.substr(row.id.size() + 1)));
      } catch (const Error&) {
        continue;
      }
    if (heightmap_name(spec) == name) return spec;
  }
  return std::nullopt;
}

/// The scene that a case's id names, as far as names say.
SceneSpec scene_called(const SettingArguments& arguments, const std::string& id, bool needs_view) {
  const std::string name(heightmap_part(id));
  SceneSpec spec{.id = id, .heightmap = told_heightmap(arguments), .scene = {}};
  if (arguments.heightmap.empty()) {
    const std::optional<HeightmapSpec> known = heightmap_called(name);
    if (!known) fail_input("the case's heightmap '{}' is no known name: say HEIGHTMAP, or --run RUN", name);
    spec.heightmap = *known;
    set_reading(spec.heightmap, arguments.reading);
  } else if (!arguments.other_heightmap && arguments.heightmap != name && heightmap_name(spec.heightmap) != name) {
    fail_input("HEIGHTMAP is {}, but the case is of {}; --other-heightmap takes it all the same",
               heightmap_name(spec.heightmap), name);
  }
  const std::string view(view_part(id));
  set_view(spec.scene, view);
  if (needs_view && spec.scene.view.id.empty() && !arguments.view)
    fail_input("the case's view '{}' is a config's own: say --run RUN, or --view", view);
  return spec;
}

}  // namespace

HeightmapSpec told_heightmap(const SettingArguments& arguments) {
  HeightmapSpec spec{.source = arguments.heightmap};
  set_reading(spec, arguments.reading);
  return spec;
}

void warn_of_holes(const Settings& settings, const HeightmapSpec& heightmap) {
  if (!is_solid(heightmap) || settings.technique().is_of_solids()) return;
  std::vector<std::string_view> whole;
  for (const Technique& technique : techniques())
    if (technique.is_of_solids()) whole.push_back(technique.id);
  print_warning(fmt::format("{} sees the upper surface of {}, a solid, alone and fills its holes; {} trace it whole",
                            settings.technique().id, heightmap_name(heightmap), fmt::join(whole, ", ")));
}

ChosenScene choose_scene(const SettingArguments& arguments, const ChosenSetting& chosen, Heightmaps& heightmaps,
                         bool needs_view, std::string_view command) {
  ChosenScene result;
  if (!chosen.scenes.empty()) {
    const Scenes scenes = of_heightmap(named(chosen.scenes, arguments.scene), arguments, heightmaps);
    const MeasuredScene& measured = one_of(scenes, arguments, needs_view);
    result = {.spec = measured.spec, .measured = measured};
  } else if (!arguments.scene.empty()) {
    fail_input("--scene {}: chooses among scenes of --presets", arguments.scene);
  } else if (!chosen.scene_id.empty()) {
    result.spec = scene_called(arguments, chosen.scene_id, needs_view);
  } else if (!arguments.heightmap.empty()) {
    result.spec = {.id = std::string(command), .heightmap = told_heightmap(arguments), .scene = {}};
  } else {
    fail_input("{} needs a HEIGHTMAP, since the case names none", command);
  }
  apply(arguments, result.spec.scene);
  if (needs_view)
    if (const std::string reason = camera_fault(result.spec.scene); !reason.empty()) fail_input("{}", reason);
  const MeasuredScene now = measured_scene(result.spec, heightmaps.read(result.spec.heightmap));
  result.is_same = result.measured && result.measured->key == now.key;
  return result;
}

}  // namespace reliefbench
