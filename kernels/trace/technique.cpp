#include "kernels/trace/technique.h"

#include <algorithm>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

Param range(std::string_view id, std::string_view description, int min, int max, int fallback,
            std::string_view active_if = {}) {
  return {.id = id, .description = description, .min = min, .max = max, .fallback = fallback, .active_if = active_if};
}

Param choice(std::string_view id, std::string_view description, std::vector<std::string_view> choices,
             std::string_view fallback) {
  const auto found = std::find(choices.begin(), choices.end(), fallback);
  const int last = static_cast<int>(choices.size()) - 1;
  const int fallback_index = static_cast<int>(found - choices.begin());
  return {.id = id, .description = description, .max = last, .fallback = fallback_index, .choices = std::move(choices)};
}

Param linear_steps() {
  return range("linear_steps", "equal steps down the ray until it is under the relief", 1, 4096, 16);
}
Param cone_steps(int fallback) { return range("cone_steps", "most cone steps a ray", 0, 4096, fallback); }
Param node_steps() { return range("node_steps", "most nodes of the pyramid that a ray visits", 1, 4096, 256); }
Param binary_steps(int fallback) {
  return range("binary_steps", "halvings of the bracket", 0, 32, fallback, "refinement=binary");
}
Param step(std::string_view fallback) {
  return choice("step",
                "the cone alone, or at least to the cell's border: untested (cell_max), or with the cell's surface "
                "solved (cell_quad)",
                {"plain", "cell_max", "cell_quad"}, fallback);
}
Param secant_steps(int fallback = 1) {
  return range("secant_steps", "probes of the secant search before its last interpolation", 0, 32, fallback,
               "refinement=secant");
}
Param refinement(std::vector<std::string_view> choices, std::string_view fallback) {
  return choice("refinement", "how the bracket round the hit is narrowed", std::move(choices), fallback);
}
Param lod() {
  return choice("lod",
                "level of the map that a ray reads: the base, or of a conservative mip chain the one whose texels are "
                "up to a pixel large; the hit then lies on or before the base's",
                {"base", "footprint"}, "base");
}

Param shared(Param param, int constant_id) {
  param.constant_id = constant_id;
  return param;
}
Param loop() {
  return shared(
      choice("loop", "run all steps, or leave when the ray has arrived", {"fixed", "early_exit"}, "early_exit"),
      kLoopConstant);
}
Param filter() {
  return shared(choice("filter", "the sampler's bilinear filter, or four fetches with full-precision weights",
                       {"hardware", "manual"}, "hardware"),
                kFilterConstant);
}
Param encoding() {
  std::vector<std::string_view> ids;
  for (const Encoding& row : encodings()) ids.push_back(row.id);
  return shared(choice("encoding", "how the cone ratio is stored", std::move(ids), "sqrt"), kEncodingConstant);
}
Param format(std::string_view fallback) {
  std::vector<std::string_view> ids;
  for (const Format& row : formats()) ids.push_back(row.id);
  Param param = choice("format", "texture format of the relief map", std::move(ids), fallback);
  param.stage = Stage::bake;  // cones are built from the heights as this format rounds them
  return param;
}
/// The corrections that any of the maps has; conflict() refuses the others.
Param correction(const std::vector<MapKind>& maps, std::string_view fallback) {
  std::vector<std::string_view> ids;
  for (const Correction value : corrections()) {
    const bool is_known = std::any_of(maps.begin(), maps.end(), [&](MapKind map) {
      const auto list = find_map(map).corrections;
      return std::find(list.begin(), list.end(), value) != list.end();
    });
    if (is_known) ids.push_back(correction_id(value));
  }
  Param param = choice("correction", "what makes interpolated cones safe", std::move(ids), fallback);
  param.stage = Stage::bake;
  return param;
}
Param map(const std::vector<MapKind>& maps) {
  std::vector<std::string_view> ids;
  ids.reserve(maps.size());
  for (const MapKind kind : maps) ids.push_back(find_map(kind).id);
  const std::string_view fallback = ids.front();
  Param param = choice("map", "which map is baked", std::move(ids), fallback);
  param.stage = Stage::bake;
  return param;
}
Param max_ratio() {
  Param param =
      choice("max_ratio", "widest cone that is baked; beyond 1 for floats and h_tan only", {"1", "unbounded"}, "1");
  param.stage = Stage::bake;
  return param;
}
Param search_steps() {
  Param param =
      range("search_steps", "forward steps of the bake's search for a ray's exit", 1, 4096, 128, "map=relaxed_po07");
  param.stage = Stage::bake;
  return param;
}
Param distance_slices() {
  Param param = range("distance_slices", "voxels from the bottom plate to the top", 4, 256, 32);
  param.stage = Stage::bake;
  return param;
}
Param only_if(std::string_view condition, Param param) {
  param.active_if = condition;
  return param;
}

/// Gives a technique's own run-time parameters their specialization constants.
Technique numbered(Technique technique) {
  auto next = static_cast<int>(kFirstOwnConstant);
  for (Param& param : technique.params)
    if (param.stage == Stage::run && param.constant_id < 0) param.constant_id = next++;
  return technique;
}

/// Of cones that no interpolation opens too far: exact where their cells are solved on the surface that is judged.
Guarantee cone_guarantee(const Settings& settings) {
  const std::string_view correction = settings.choice("correction");
  const std::string_view step = settings.choice("step");
  const bool is_safe = correction == "safe" || correction == "certified" || correction == "min4";
  const MapKind map = map_of(settings).kind;
  const bool is_conservative = map != MapKind::quick_published && map != MapKind::quick_centre;
  if (!is_safe || !is_conservative || step == "cell_max") return Guarantee::none;
  const bool is_coarse = settings.technique().find("lod") != nullptr && settings.choice("lod") != "base";
  return step == "cell_quad" && !is_coarse ? Guarantee::exact : Guarantee::never_skips;
}

std::vector<Technique> rows() {
  const std::vector<MapKind> cone_maps{MapKind::conservative, MapKind::quick, MapKind::quick_naive,
                                       MapKind::quick_published, MapKind::quick_centre};
  const std::vector<MapKind> relaxed_maps{MapKind::relaxed_po07, MapKind::relaxed, MapKind::hybrid};
  const std::vector<MapKind> interval_maps{MapKind::relaxed_po07, MapKind::relaxed, MapKind::conservative,
                                           MapKind::quick};
  return {
      {.id = "flat",
       .description = "no relief: the floor of frame time",
       .maps = {MapKind::height},
       .params = {},
       .guarantee = Guarantee::none,
       .guarantee_note = "",
       .source = "-"},
      {.id = "parallax",
       .description = "one lookup, shifted by its height",
       .maps = {MapKind::height},
       .params = {choice("variant", "full shift, or limited by the view's angle", {"plain", "offset_limited"},
                         "offset_limited"),
                  format("r8"), filter()},
       .guarantee = Guarantee::none,
       .guarantee_note = "right only where the relief is flat",
       .source = "[KAN01]; offset limit: Welsh 2004"},
      {.id = "relief",
       .description = "linear search, then refinement",
       .maps = {MapKind::height},
       .params = {linear_steps(), refinement({"none", "secant", "binary"}, "binary"), binary_steps(5), secant_steps(),
                  loop(), format("r8"), filter()},
       .guarantee = Guarantee::none,
       .guarantee_note = "may step over features thinner than one linear step",
       .source = "[RTM] listing 5.3"},
      {.id = "depth_slices",
       .description = "planes of equal distance, the highest at or under the surface; the passes as one loop",
       .maps = {MapKind::height},
       .params = {range("slices", "planes; the lowest is the bottom plate", 1, 4096, 16), loop(), format("r8"),
                  filter()},
       .guarantee = Guarantee::none,
       .guarantee_note = "hits lie on planes: e_z is up to 1 / slices, and beyond where a thinner feature is skipped",
       .source = "[RTM] listing 5.2"},
      {.id = "interval",
       .description = "linear or cone search, then chords of the surface between the bracket's ends; n chords are "
                      "refinement=secant with n - 1 probes",
       .maps = {MapKind::height, MapKind::relaxed_po07, MapKind::relaxed, MapKind::conservative, MapKind::quick},
       .params = {choice("search", "what finds the bracket", {"linear", "cone"}, "linear"),
                  only_if("search=linear", linear_steps()), only_if("search=cone", cone_steps(15)),
                  range("interval_steps", "chords that are intersected; the last one is the hit", 0, 32, 2), loop(),
                  only_if("search=cone", map(interval_maps)), only_if("map=relaxed_po07", search_steps()),
                  only_if("search=cone", correction(interval_maps, "none")), only_if("search=cone", max_ratio()),
                  format("rg16"), only_if("search=cone", encoding()), filter()},
       .guarantee = Guarantee::none,
       .guarantee_note = "as the search: linear steps and relaxed cones may skip; an ulp decides whether a step has "
                         "pierced thin relief",
       .source = "[RIS05]",
       .disagreement = 0.05},
      {.id = "cone",
       .description = "conservative cone stepping",
       .maps = cone_maps,
       .params = {cone_steps(32), step("cell_quad"), refinement({"none", "secant", "binary"}, "none"), binary_steps(6),
                  secant_steps(), lod(), loop(), map(cone_maps), correction(cone_maps, "safe"), max_ratio(),
                  format("rg16"), encoding(), filter()},
       .guarantee = Guarantee::exact,
       .guarantee_note = "with correction safe, certified or min4 on the heights as stored: exact with cell_quad, "
                         "never_skips with plain; cell_max skips the rest of a cell untested; quick_published and "
                         "quick_centre maps are not conservative. With lod=footprint a ray never passes the base "
                         "surface, but may stop before it, which unconverged_rate counts",
       .source = "[DUM06]; cell steps [BVBV24]",
       .guarantee_when = cone_guarantee},
      {.id = "relaxed_cone",
       .description = "relaxed cone stepping, then refinement",
       .maps = relaxed_maps,
       .params = {cone_steps(15), step("plain"), refinement({"none", "secant", "binary"}, "binary"), binary_steps(6),
                  secant_steps(), loop(), map(relaxed_maps), search_steps(), correction(relaxed_maps, "none"),
                  max_ratio(), format("rg16"), encoding(), filter()},
       .guarantee = Guarantee::none,
       .guarantee_note = "cones are right only for rays that start at the top plate, so later steps can skip [BES12]; "
                         "an ulp decides whether a step has pierced thin relief",
       .source = "[PO07] listing 18-3",
       .disagreement = 0.05},
      {.id = "quad_cone",
       .description = "conservative cone stepping with a cone for each quarter of the directions",
       .maps = {MapKind::quad},
       .params = {cone_steps(32), step("cell_quad"), refinement({"none", "secant", "binary"}, "none"), binary_steps(6),
                  secant_steps(), loop(), correction({MapKind::quad}, "safe"), format("r16+rgba16"), encoding(),
                  filter()},
       .guarantee = Guarantee::exact,
       .guarantee_note = "with correction=safe on the heights as stored: exact with cell_quad, never_skips with plain",
       .source = "QDCSM; cell steps [BVBV24]",
       .guarantee_when = cone_guarantee},
      {.id = "safety_shape",
       .description = "relaxed cone stepping, or by the cylinder's radius where that is farther; then refinement",
       .maps = {MapKind::safety_shape},
       .params = {cone_steps(15), step("plain"), refinement({"none", "secant", "binary"}, "binary"), binary_steps(6),
                  secant_steps(), loop(), correction({MapKind::safety_shape}, "none"), max_ratio(),
                  format("r16+rgba16"), encoding(), filter()},
       .guarantee = Guarantee::none,
       .guarantee_note =
           "interpolated shapes may be wider than those of the texels, and a ray within them may then skip",
       .source = "[BES12]",
       .disagreement = 0.05},
      {.id = "max_mip",
       .description = "down a pyramid of the bilinear cells' maxima, the cells solved",
       .maps = {MapKind::max_mip},
       .params = {node_steps(), format("r16")},
       .guarantee = Guarantee::exact,
       .guarantee_note = "on the heights as stored, wherever node_steps are enough",
       .source = "[TIS08]",
       .guarantee_when = [](const Settings&) { return Guarantee::exact; }},
      {.id = "qdm",
       .description = "down a quadtree of the texels' maxima, then refinement",
       .maps = {MapKind::quadtree},
       .params = {node_steps(), refinement({"none", "secant", "binary"}, "secant"), binary_steps(6), secant_steps(0),
                  format("r16"), filter()},
       .guarantee = Guarantee::none,
       .guarantee_note = "texels' blocks do not bound the bilinear surface between them",
       .source = "[DRO18]; secant_steps=0 is its linear refinement"},
      {.id = "distance",
       .description = "sphere tracing through a volume of distances",
       .maps = {MapKind::distance},
       .params = {range("sphere_steps", "most spheres a ray", 0, 4096, 64),
                  choice("step",
                         "beside the relief: on by a voxel, then refinement (published), or at least to the cell's "
                         "border, with the cell's surface solved (cell_quad)",
                         {"published", "cell_quad"}, "cell_quad"),
                  only_if("step=published", refinement({"none", "secant", "binary"}, "binary")), binary_steps(6),
                  secant_steps(), distance_slices(), format("r16"), only_if("step=published", filter())},
       .guarantee = Guarantee::exact,
       .guarantee_note = "with step=cell_quad, on the heights as stored, wherever sphere_steps are enough; published "
                         "steps can pass features thinner than a voxel",
       .source = "[DON05]; distances as bounds, cell_quad ours",
       .guarantee_when =
           [](const Settings& settings) {
             return settings.choice("step") == "cell_quad" ? Guarantee::exact : Guarantee::none;
           }},
  };
}

}  // namespace

std::string Param::text(int value) const {
  return choices.empty() ? fmt::format("{}", value) : std::string(choices.at(static_cast<std::size_t>(value)));
}

const Param* Technique::find(std::string_view param_id) const {
  const auto found = std::find_if(params.begin(), params.end(), [&](const Param& p) { return p.id == param_id; });
  return found == params.end() ? nullptr : &*found;
}

const std::vector<Technique>& techniques() {
  static const std::vector<Technique> table = [] {
    std::vector<Technique> list = rows();
    std::transform(list.begin(), list.end(), list.begin(), numbered);
    return list;
  }();
  return table;
}

const Technique& find_technique(std::string_view id) {
  std::string choices;
  for (const Technique& row : techniques()) {
    if (row.id == id) return row;
    choices += fmt::format("{}{}", choices.empty() ? "" : ", ", row.id);
  }
  fail_input("unknown technique '{}' (expected one of {})", id, choices);
}

std::string_view guarantee_id(Guarantee guarantee) {
  switch (guarantee) {
    case Guarantee::none:
      return "none";
    case Guarantee::never_skips:
      return "never_skips";
    case Guarantee::exact:
      return "exact";
  }
  return "none";
}

}  // namespace reliefbench
