#include "kernels/trace/technique_rows.h"

#include <initializer_list>

#include "kernels/trace/storage_params.h"

namespace reliefbench {
namespace {

Param linear_steps() {
  return range_param("linear_steps", "equal steps down the ray until it is under the relief", 1, 4096, 16);
}
Param cone_steps(int fallback) { return range_param("cone_steps", "most cone steps a ray", 0, 4096, fallback); }
Param node_steps() { return range_param("node_steps", "most nodes of the pyramid that a ray visits", 1, 4096, 256); }
Param step(std::string_view fallback) {
  return choice_param("step",
                      "the cone alone, or at least to the cell's border: untested (cell_max), or with the cell's "
                      "surface solved (cell_quad)",
                      {"plain", "cell_max", "cell_quad"}, fallback);
}
/// Whose default ids leave out: it came when there were ids already.
Param later(Param param) {
  param.is_spelt_out = false;
  return param;
}
Param over_relaxation() {
  return later(
      choice_param("over_relaxation",
                   "steps beyond the cone, by a fixed factor or one that adapts; where the cone at the end does not "
                   "reach back to where the first one ended, that is where the ray goes on",
                   {"none", "1_3", "auto"}, "none"));
}
Param loop() {
  Param param =
      choice_param("loop", "run all steps, or leave when the ray has arrived", {"fixed", "early_exit"}, "early_exit");
  param.constant_id = kLoopConstant;
  return param;
}
Param only_if(std::string_view condition, Param param) {
  param.active_if = condition;
  return param;
}

Param dither() {
  return later(
      choice_param("dither",
                   "where in its first linear step a ray begins: at its end; or elsewhere in each pixel (pixel), and "
                   "in each of eight frames, too, whose mean is what people see (temporal)",
                   {"none", "pixel", "temporal"}, "none"));
}

/// The linear search's steps, and how many of them a ray takes.
std::vector<Param> paced_linear_steps() {
  return {linear_steps(),
          later(choice_param("steps_by",
                             "how many of its linear steps a ray takes: all; or, towards least_steps, fewer the "
                             "steeper it is on the plane (view) or in the map (slope); or by its length in texels",
                             {"count", "view", "slope", "length"}, "count")),
          only_if("steps_by=view|slope|length", range_param("least_steps", "of a ray at least", 1, 4096, 8)),
          only_if("steps_by=length", range_param("texels_a_step", "of the level that is read", 1, 64, 2)), dither()};
}

/// The refinement of a technique's bracket. binary_steps, secant_steps: their defaults
std::vector<Param> refinement(std::string_view fallback, int binary_steps = 6, int secant_steps = 1,
                              std::string_view condition = {}) {
  return params_of({.feature = "refinement",
                    .fallback = fallback,
                    .active_if = condition,
                    .fallbacks = {{"binary_steps", binary_steps}, {"secant_steps", secant_steps}}});
}

/// `lod` among a technique's own, where ids have always spelt it out.
std::vector<Param> lod() { return params_of({.feature = "lod", .is_spelt_out = true}); }

std::vector<Param> joined(std::initializer_list<std::vector<Param>> lists) {
  std::vector<Param> all;
  for (const std::vector<Param>& list : lists) all.insert(all.end(), list.begin(), list.end());
  return all;
}

/// Of cones that no interpolation opens too far: exact where their cells are solved on the surface that is judged.
Guarantee cone_guarantee(const Settings& settings) {
  if (!has_free_cones(settings) || settings.is("step", "cell_max")) return Guarantee::none;
  return settings.is("step", "cell_quad") && !reads_levels(settings) ? Guarantee::exact : Guarantee::never_skips;
}

Guarantee solid_cone_guarantee(const Settings& settings) {
  return settings.is("correction", "safe") ? Guarantee::exact : Guarantee::none;
}

/// Features of the scene that solids do not have yet: coarser levels, a relief that is left, rays from the hit, depths
/// of rays that pass, curved surfaces.
std::vector<FeatureUse> without_solids(std::vector<FeatureUse> uses = {}) {
  for (const std::string_view id : {"shadow", "lod", "fade", "silhouette", "depth"})
    uses.push_back({.feature = id, .is_absent = true});
  return uses;
}

}  // namespace

std::vector<Technique> technique_rows() {
  const std::vector<MapKind> cone_maps{MapKind::conservative, MapKind::quick, MapKind::quick_naive,
                                       MapKind::quick_published, MapKind::quick_centre};
  const std::vector<MapKind> relaxed_maps{MapKind::relaxed_po07, MapKind::relaxed, MapKind::hybrid};
  return {
      {.id = "flat",
       .description = "no relief: the floor of frame time",
       .maps = {MapKind::height},
       .params = {},
       .storage = {},
       .guarantee = Guarantee::none,
       .guarantee_note = "",
       .source = "-"},
      {.id = "parallax",
       .description = "one lookup, shifted by its height",
       .maps = {MapKind::height},
       .params = {choice_param("variant", "full shift, or limited by the view's angle", {"plain", "offset_limited"},
                               "offset_limited")},
       .storage = StorageUse{.format = "r8"},
       .guarantee = Guarantee::none,
       .guarantee_note = "right only where the relief is flat",
       .source = "[KAN01]; offset limit: Welsh 2004"},
      {.id = "relief",
       .description = "linear search, then refinement",
       .maps = {MapKind::height},
       .params = joined({paced_linear_steps(), refinement("binary", 5), {loop()}}),
       .storage = StorageUse{.format = "r8"},
       .guarantee = Guarantee::none,
       .guarantee_note = "may step over features thinner than one linear step",
       .source = "[RTM] listing 5.3"},
      {.id = "depth_slices",
       .description = "planes of equal distance, the highest at or under the surface; the passes as one loop",
       .maps = {MapKind::height},
       .params = {range_param("slices", "planes; the lowest is the bottom plate", 1, 4096, 16), loop()},
       .storage = StorageUse{.format = "r8"},
       .guarantee = Guarantee::none,
       .guarantee_note = "hits lie on planes: e_z is up to 1 / slices, and beyond where a thinner feature is skipped",
       .source = "[RTM] listing 5.2"},
      {.id = "interval",
       .description = "linear or cone search, then chords of the surface between the bracket's ends; n chords are "
                      "refinement=secant with n - 1 probes",
       .maps = {MapKind::height, MapKind::relaxed_po07, MapKind::relaxed, MapKind::conservative, MapKind::quick},
       .params = {choice_param("search", "what finds the bracket", {"linear", "cone"}, "linear"),
                  only_if("search=linear", linear_steps()), only_if("search=linear", dither()),
                  only_if("search=cone", cone_steps(15)),
                  range_param("interval_steps", "chords that are intersected; the last one is the hit", 0, 32, 2),
                  loop()},
       .storage = StorageUse{.format = "rg16", .active_if = "search=cone"},
       .guarantee = Guarantee::none,
       .guarantee_note = "as the search: linear steps and relaxed cones may skip; an ulp decides whether a step has "
                         "pierced thin relief",
       .source = "[RIS05]",
       .disagreement = 0.05},
      {.id = "cone",
       .description = "conservative cone stepping",
       .maps = cone_maps,
       .params = joined({{cone_steps(32), step("cell_quad")}, refinement("none"), lod(), {over_relaxation(), loop()}}),
       .storage = StorageUse{.format = "rg16", .correction = "safe"},
       .guarantee = Guarantee::exact,
       .guarantee_note = "with correction safe, certified or min4 on the heights as stored: exact with cell_quad, "
                         "never_skips with plain; cell_max skips the rest of a cell untested; quick_published and "
                         "quick_centre maps are not conservative. On coarser levels a ray never passes the base "
                         "surface, but may stop before it, which unconverged_rate counts",
       .source = "[DUM06]; cell steps [BVBV24]; over-relaxed ones after Keinert et al. 2014 and Ban and Valasek 2023, "
                 "proved by the cone's way back (ours)",
       .guarantee_when = cone_guarantee},
      {.id = "relaxed_cone",
       .description = "relaxed cone stepping, then refinement",
       .maps = relaxed_maps,
       .params = joined({{cone_steps(15), step("plain")}, refinement("binary"), {loop()}}),
       .storage = StorageUse{.format = "rg16"},
       .guarantee = Guarantee::none,
       .guarantee_note = "cones are right only for rays that start at the top plate, so later steps can skip [BES12]; "
                         "an ulp decides whether a step has pierced thin relief",
       .source = "[PO07] listing 18-3",
       .disagreement = 0.05},
      {.id = "quad_cone",
       .description = "conservative cone stepping with a cone for each quarter of the directions",
       .maps = {MapKind::quad},
       .params = joined({{cone_steps(32), step("cell_quad")}, refinement("none"), {over_relaxation(), loop()}}),
       .storage = StorageUse{.format = "r16+rgba16", .correction = "safe", .has_max_ratio = false},
       .guarantee = Guarantee::exact,
       .guarantee_note =
           "with correction safe or certified on the heights as stored: exact with cell_quad, never_skips with plain",
       .source = "QDCSM; cell steps [BVBV24]",
       .guarantee_when = cone_guarantee},
      {.id = "safety_shape",
       .description = "relaxed cone stepping, or by the cylinder's radius where that is farther; then refinement",
       .maps = {MapKind::safety_shape},
       .params = joined({{cone_steps(15), step("plain")}, refinement("binary"), {loop()}}),
       .storage = StorageUse{.format = "r16+rgba16"},
       .guarantee = Guarantee::none,
       .guarantee_note =
           "interpolated shapes may be wider than those of the texels, and a ray within them may then skip",
       .source = "[BES12]",
       .disagreement = 0.05},
      {.id = "max_mip",
       .description = "down a pyramid of the bilinear cells' maxima, the cells solved",
       .maps = {MapKind::max_mip},
       .params = {node_steps()},
       .storage = StorageUse{.format = "r16"},
       .features = {{.feature = "filter", .is_absent = true}},
       .guarantee = Guarantee::exact,
       .guarantee_note = "on the heights as stored, wherever node_steps are enough",
       .source = "[TIS08]",
       .guarantee_when =
           [](const Settings& settings) { return reads_levels(settings) ? Guarantee::never_skips : Guarantee::exact; }},
      {.id = "qdm",
       .description = "down a quadtree of the texels' maxima, then refinement",
       .maps = {MapKind::quadtree},
       .params = joined({{node_steps()}, refinement("secant", 6, 0)}),
       .storage = StorageUse{.format = "r16"},
       .guarantee = Guarantee::none,
       .guarantee_note =
           "texels' blocks do not bound the bilinear surface between them; where it lies flat in a block's "
           "top, an ulp decides what is refined",
       .source = "[DRO18]; secant_steps=0 is its linear refinement",
       .disagreement = 0.05},
      {.id = "distance",
       .description = "sphere tracing through a volume of distances",
       .maps = {MapKind::distance},
       .params = joined({{range_param("sphere_steps", "most spheres a ray", 0, 4096, 64),
                          choice_param("step",
                                       "beside the relief: on by a voxel, then refinement (published), or at least to "
                                       "the cell's border, with the cell's surface solved (cell_quad)",
                                       {"published", "cell_quad"}, "cell_quad")},
                         refinement("binary", 6, 1, "step=published")}),
       .storage = StorageUse{.format = "r16"},
       .features = {{.feature = "filter", .active_if = "step=published"}, {.feature = "lod", .is_absent = true}},
       .guarantee = Guarantee::exact,
       .guarantee_note = "with step=cell_quad, on the heights as stored, wherever sphere_steps are enough; published "
                         "steps can pass features thinner than a voxel",
       .source = "[DON05]; distances as bounds, cell_quad ours",
       .guarantee_when =
           [](const Settings& settings) {
             return settings.is("step", "cell_quad") ? Guarantee::exact : Guarantee::none;
           }},
      {.id = "depth_passes",
       .description = "planes of equal distance, each a draw over the last one, the bottom one first",
       .maps = {MapKind::height},
       .params = {range_param("passes", "draws, one a plane; the lowest is the bottom plate", 1, 1024, 16),
                  choice_param("facing", "planes parallel to the plate, or across the view's axis", {"plate", "camera"},
                               "plate")},
       .storage = StorageUse{.format = "r8"},
       .guarantee = Guarantee::none,
       .guarantee_note = "with facing=plate the hits of depth_slices with as many slices, to the bit; with "
                         "facing=camera rays that are longer than the middle one run out of planes",
       .source = "[RTM] listing 5.2; across the view: [RTM] 5.2, their places ours",
       .disagreement = 0.05,
       .passes = "passes"},
      {.id = "omni",
       .description = "one look into a table of exact hits, by the ray's position and direction; no search",
       .maps = {MapKind::omni},
       .params = {choice_param("lookup",
                               "by fetches of the nearest entries (fetched), or as printed: through the sampler's "
                               "filter, the value taken for a way along the ray (published)",
                               {"fetched", "published"}, "fetched"),
                  only_if("lookup=fetched",
                          choice_param("interpolation", "between which of the nearest entries: 1, 4, 4 or 16 fetches",
                                       {"none", "position", "direction", "both"}, "both"))},
       .storage = StorageUse{.format = "r16"},
       .features = {{.feature = "filter", .active_if = "lookup=published"}, {.feature = "lod", .is_absent = true}},
       .guarantee = Guarantee::none,
       .guarantee_note =
           "hits of the table's own rays are exact up to the format's rounding; between them they may lie "
           "anywhere from the top plate to the bottom one, and rays flatter than the table's outermost "
           "are read as those",
       .source = "[RTM] 5.9, listing 5.9; octahedral directions, fetches and interpolation ours",
       .disagreement = 0.05},
      {.id = "double_relief",
       .description = "of solids: linear search for a step between both surfaces, then refinement; a ray may pass",
       .maps = {MapKind::double_height},
       .params = joined({{linear_steps()}, refinement("binary", 5), {loop()}}),
       .storage = StorageUse{.format = "rg8"},
       .features = without_solids(),
       .guarantee = Guarantee::none,
       .guarantee_note = "may step over solids thinner than one linear step: false holes",
       .source = "[RTM] listing 5.3, RM_DOUBLEDEPTH"},
      {.id = "double_cone",
       .description =
           "of solids: cone stepping over the upper surface and under the lower one, the cells solved; a ray "
           "may pass",
       .maps = {MapKind::double_cone},
       .params = {cone_steps(64)},
       .storage = StorageUse{.format = "r16+rgba16", .correction = "safe"},
       .features = without_solids(),
       .guarantee = Guarantee::exact,
       .guarantee_note = "with correction=safe on the heights as stored, wherever cone_steps are enough",
       .source = "cones [DUM06], downwards ours; cell steps [BVBV24]",
       .guarantee_when = solid_cone_guarantee},
      {.id = "double_mip",
       .description = "of solids: down a pyramid of the cells' highest tops and lowest floors, the cells solved; a ray "
                      "may pass",
       .maps = {MapKind::double_mip},
       .params = {node_steps()},
       .storage = StorageUse{.format = "rg16"},
       .features = without_solids({{.feature = "filter", .is_absent = true}}),
       .guarantee = Guarantee::exact,
       .guarantee_note = "on the heights as stored, wherever node_steps are enough",
       .source = "[TIS08], with floors ours",
       .guarantee_when = [](const Settings& /*settings*/) { return Guarantee::exact; }},
      {.id = "sector_cone",
       .description = "conservative cone stepping with a cone for each of 4, 8 or 16 sectors of directions, one fetch "
                      "a step",
       .maps = {MapKind::sector},
       .params = joined({{cone_steps(32), step("cell_quad")},
                         refinement("none"),
                         {only_if("ratios_a_texel=2", over_relaxation()), loop()}}),
       .storage = StorageUse{.format = "rg16", .correction = "safe", .has_max_ratio = false},
       .features = {{.feature = "lod", .is_absent = true}},
       .guarantee = Guarantee::exact,
       .guarantee_note = "with correction safe or certified on the heights as stored: exact with cell_quad, "
                         "never_skips with plain where filter=manual; cell_max skips the rest of a cell untested",
       .source = "ours; of four sectors QDCSM; cell steps [BVBV24]; over-relaxed ones as those of `cone`",
       .guarantee_when = cone_guarantee},
      {.id = "sector_relaxed",
       .description = "relaxed cone stepping with a cone for each of 4, 8 or 16 sectors of directions, then refinement",
       .maps = {MapKind::sector_relaxed},
       .params = joined({{cone_steps(15), step("plain")}, refinement("binary"), {loop()}}),
       .storage = StorageUse{.format = "rg16", .has_max_ratio = false},
       .features = {{.feature = "lod", .is_absent = true}},
       .guarantee = Guarantee::none,
       .guarantee_note = "cones are right only for rays that start at the top plate, so later steps can skip [BES12]; "
                         "an ulp decides whether a step has pierced thin relief",
       .source = "[PO07] listing 18-3; sectors ours",
       .disagreement = 0.05},
      {.id = "cell_cone",
       .description = "conservative cone stepping with a cone for each cell of the surface and each quarter of "
                      "directions, one fetch a step; cells solved",
       .maps = {MapKind::cell},
       .params = {cone_steps(64)},
       .storage = StorageUse{.format = "rg16", .has_max_ratio = false},
       .features = {{.feature = "filter", .is_absent = true}, {.feature = "lod", .is_absent = true}},
       .guarantee = Guarantee::exact,
       .guarantee_note = "on the heights as stored, wherever cone_steps are enough",
       .source = "ours; a loop in a loop [AL09]",
       .guarantee_when = [](const Settings& /*settings*/) { return Guarantee::exact; }},
  };
}

}  // namespace reliefbench
