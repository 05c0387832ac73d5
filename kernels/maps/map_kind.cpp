#include "kernels/maps/map_kind.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <string>

#include "kernels/base/error.h"
#include "kernels/base/suggest.h"
#include "kernels/maps/cell_map.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/distance_map.h"
#include "kernels/maps/omni_table.h"
#include "kernels/maps/pyramid_map.h"
#include "kernels/maps/sector_map.h"
#include "kernels/maps/solid_map.h"

namespace reliefbench {
namespace {

constexpr std::array kNone{Correction::none};
constexpr std::array kConservative{Correction::none, Correction::min3x3, Correction::safe, Correction::certified,
                                   Correction::min4};
constexpr std::array kQuick{Correction::none, Correction::min3x3, Correction::safe, Correction::min4};
constexpr std::array kSafe{Correction::none, Correction::min3x3, Correction::safe};
constexpr std::array kRelaxed{Correction::none, Correction::min3x3};
constexpr std::array kByDirection{Correction::none, Correction::min3x3, Correction::safe, Correction::certified};

std::vector<float> bake_nothing(const BakeRequest& request) {
  check_bakeable(request.heights);
  return {};
}
std::vector<float> bake_solid_nothing(const BakeRequest& request) {
  check_solid(request.heights);
  return {};
}

constexpr std::array kMaps{
    MapRow{.kind = MapKind::height,
           .id = "height",
           .description = "heights alone",
           .source = "[RTM]",
           .guarantee = "the heights as the format rounds them",
           .content = MapContent::heights,
           .corrections = kNone,
           .bake = bake_nothing,
           .version = 1},
    MapRow{.kind = MapKind::conservative,
           .id = "conservative",
           .description = "widest cone of each texel that holds no texel above",
           .source = "[DUM06]",
           .guarantee = "a cone contains no texel centre's surface point; with `safe`, no point of the surface",
           .content = MapContent::ratios,
           .ratios = 1,
           .corrections = kConservative,
           .promise = MapPromise::conservative,
           .bake = bake_conservative,
           .version = 2},
    MapRow{.kind = MapKind::quick_naive,
           .id = "quick_naive",
           .description = "conservative cones from a max pyramid: the nearest texel of the 3 x 3 nodes round each "
                          "texel, on every level",
           .source = "[VB22] algorithm 1",
           .guarantee = "never wider than `conservative`, whatever the correction",
           .content = MapContent::ratios,
           .ratios = 1,
           .corrections = kQuick,
           .promise = MapPromise::conservative,
           .bake = bake_quick_naive,
           .version = 1},
    MapRow{.kind = MapKind::quick,
           .id = "quick",
           .description = "the same from each node's nearest texel that no finer level has visited",
           .source = "[VB22] algorithm 2, corner tests corrected",
           .guarantee = "at least as wide as `quick_naive`, never wider than `conservative`, whatever the correction",
           .content = MapContent::ratios,
           .ratios = 1,
           .corrections = kQuick,
           .promise = MapPromise::conservative,
           .bake = bake_quick,
           .version = 1},
    MapRow{
        .kind = MapKind::quick_published,
        .id = "quick_published",
        .description = "`quick` with the corner tests as published: two of the four corners are measured too far away",
        .source = "[VB22] QuickConemap.cs.slang",
        .guarantee = "claimed to be conservative, and is not: some cones contain a texel",
        .content = MapContent::ratios,
        .ratios = 1,
        .corrections = kQuick,
        .promise = MapPromise::conservative,
        .bake = bake_quick_published,
        .version = 1},
    MapRow{.kind = MapKind::quick_centre,
           .id = "quick_centre",
           .description = "`quick_naive` with each node's centre instead of its nearest texel: a heuristic, openly",
           .source = "[VB22] section 3",
           .guarantee = "none: a cone may contain texels",
           .content = MapContent::ratios,
           .ratios = 1,
           .corrections = kQuick,
           .promise = MapPromise::none,
           .bake = bake_quick_centre,
           .version = 1},
    MapRow{.kind = MapKind::relaxed_po07,
           .id = "relaxed_po07",
           .description = "cones inside which a ray from the top plate enters the relief at most once",
           .source = "[PO07] listings 18-1 and 18-2",
           .guarantee = "a ray from the top plate over a texel, towards another texel's surface point, does not leave "
                        "the relief within the cone, as far as the search's steps see",
           .content = MapContent::ratios,
           .ratios = 1,
           .corrections = kRelaxed,
           .parameters = {&kSearchSteps, 1},
           .is_relaxed = true,
           .sees_pairs = true,
           .bake = bake_relaxed_po07,
           .version = 2},
    MapRow{.kind = MapKind::relaxed,
           .id = "relaxed",
           .description = "widest cones that hold no point where the surface goes down, seen from the texel",
           .source = "[BVBV24] algorithm 2, axes included, factor 1/N",
           .guarantee = "a ray over a texel crosses the surface at most once inside its cone; `safe` is not proved for "
                        "relaxed cones",
           .content = MapContent::ratios,
           .ratios = 1,
           .corrections = kSafe,
           .promise = MapPromise::relaxed,
           .is_relaxed = true,
           .bake = bake_relaxed,
           .version = 1},
    MapRow{.kind = MapKind::quad,
           .id = "quad",
           .description = "four conservative cones a texel, for the directions +x, -x, +y and -y; each bounds the 90 "
                          "degrees round its axis",
           .source = "QDCSM",
           .guarantee =
               "a sector of a cone contains no texel centre's surface point; with `safe` or `certified`, no point of "
               "the surface",
           .content = MapContent::ratios,
           .ratios = 4,
           .corrections = kByDirection,
           .promise = MapPromise::conservative,
           .bake = bake_quad,
           .version = 2},
    MapRow{.kind = MapKind::hybrid,
           .id = "hybrid",
           .description = "the mean of the conservative and the relaxed ratio: a cone between the two; the paper's own "
                          "rule is not public",
           .source = "[CHRS17]",
           .guarantee = "at most `relaxed`, at least `conservative`",
           .content = MapContent::ratios,
           .ratios = 1,
           .corrections = kRelaxed,
           .promise = MapPromise::none,
           .is_relaxed = true,
           .bake = bake_hybrid,
           .version = 1},
    MapRow{.kind = MapKind::safety_shape,
           .id = "safety_shape",
           .description =
               "the relaxed cone, and the radius of an upright cylinder round the texel: their union is safe; "
               "the paper's own shape is not public",
           .source = "[BES12]",
           .guarantee = "a ray over a texel crosses the surface at most once inside its cone or its cylinder",
           .content = MapContent::ratios,
           .ratios = 2,
           .corrections = kRelaxed,
           .promise = MapPromise::relaxed,
           .is_relaxed = true,
           .bake = bake_safety_shape,
           .version = 1},
    MapRow{.kind = MapKind::max_mip,
           .id = "max_mip",
           .description = "mip chain of the bilinear cells' maxima",
           .source = "[TIS08]",
           .guarantee = "no point of the surface is above the node that covers it",
           .content = MapContent::pyramid,
           .corrections = kNone,
           .bake = bake_max_mip,
           .version = 1},
    MapRow{.kind = MapKind::quadtree,
           .id = "quadtree",
           .description = "mip chain of the texels' maxima",
           .source = "[DRO18]",
           .guarantee = "no texel is above a node that covers it; the bilinear surface between nodes may be",
           .content = MapContent::pyramid,
           .corrections = kNone,
           .bake = bake_quadtree,
           .version = 1},
    MapRow{.kind = MapKind::distance,
           .id = "distance",
           .description = "voxels that hold their distance to the relief",
           .source = "[DON05], bounds instead of samples",
           .guarantee = "no point of the surface is nearer to any point of a voxel than its value",
           .content = MapContent::volume,
           .corrections = kNone,
           .parameters = {&kDistanceSlices, 1},
           .bake = bake_distance,
           .version = 1},
    MapRow{.kind = MapKind::omni,
           .id = "omni",
           .description = "where the rays of many directions from each position end",
           .source = "[RTM] 5.9; octahedral directions ours",
           .guarantee = "a value is the exact first hit of its texel's ray, as the format rounds it",
           .content = MapContent::table,
           .corrections = kNone,
           .parameters = kOmniParams,
           .promise = MapPromise::exact_rays,
           .bake = bake_omni,
           .refusal = omni_refusal,
           .version = 1},
    MapRow{.kind = MapKind::double_height,
           .id = "double_height",
           .description = "two heights: a solid's upper and lower surface",
           .source = "[RTM] double depth",
           .guarantee = "the heights as the format rounds them",
           .content = MapContent::heights,
           .corrections = kNone,
           .is_solid = true,
           .bake = bake_solid_nothing,
           .version = 1},
    MapRow{.kind = MapKind::double_cone,
           .id = "double_cone",
           .description = "two heights, and two conservative cones: one up from the upper surface, one down from the "
                          "lower one",
           .source = "cones [DUM06], downwards ours",
           .guarantee = "neither cone contains a texel centre's surface point; with `safe`, no point of the solid",
           .content = MapContent::ratios,
           .ratios = 2,
           .corrections = kSafe,
           .promise = MapPromise::conservative,
           .is_solid = true,
           .bake = bake_double_cone,
           .version = 1},
    MapRow{.kind = MapKind::double_mip,
           .id = "double_mip",
           .description = "two heights, and a mip chain of the cells' highest tops and lowest floors",
           .source = "[TIS08], with floors ours",
           .guarantee = "no point of the solid is above or below the node that covers it",
           .content = MapContent::pyramid,
           .corrections = kNone,
           .is_solid = true,
           .bake = bake_double_mip,
           .version = 2},
    MapRow{.kind = MapKind::sector,
           .id = "sector",
           .description = "a conservative cone for each of 4, 8 or 16 sectors of directions; height and ratio of a "
                          "sector together (two ratios a texel: the opposite sector's, too), a layer for each "
                          "sector in one texture",
           .source = "ours; of four sectors QDCSM",
           .guarantee =
               "a sector of a cone contains no texel centre's surface point; with `safe`, no point of the surface",
           .content = MapContent::sectors,
           .ratios = 1,
           .corrections = kByDirection,
           .parameters = kSectorParameters,
           .promise = MapPromise::conservative,
           .bake = bake_sector,
           .version = 2},
    MapRow{.kind = MapKind::sector_relaxed,
           .id = "sector_relaxed",
           .description = "a relaxed cone for each of 4, 8 or 16 sectors of directions, stored as `sector`",
           .source = "[BVBV24] algorithm 2 in each sector",
           .guarantee = "a ray over a texel crosses the surface at most once inside its sector's cone; `safe` is not "
                        "proved for relaxed cones",
           .content = MapContent::sectors,
           .ratios = 1,
           .corrections = kSafe,
           .parameters = {&kSectors, 1},
           .promise = MapPromise::relaxed,
           .is_relaxed = true,
           .bake = bake_sector_relaxed,
           .version = 1},
    MapRow{.kind = MapKind::cell,
           .id = "cell",
           .description =
               "a conservative cone for each cell of the surface and each of 4 quarters of directions, on the "
               "cell's highest corner; that height and the ratio together, a layer for each quarter in one "
               "texture",
           .source = "ours",
           .guarantee = "from no point over the cell, at that height, does the cone hold a point of the surface in its "
                        "quarter",
           .content = MapContent::sectors,
           .ratios = 1,
           .corrections = kNone,
           .promise = MapPromise::conservative,
           .is_of_cells = true,
           .bake = bake_cell,
           .version = 1},
};

}  // namespace

std::span<const MapRow> map_kinds() { return kMaps; }

const MapRow& find_map(MapKind kind) {
  const auto* row = std::ranges::find(kMaps, kind, &MapRow::kind);
  assert(row != kMaps.end());
  return *row;
}

const MapRow& find_map(std::string_view id) { return find_row(kMaps, "map kind", id); }

std::span<const Correction> corrections() {
  static constexpr std::array kAll{Correction::none, Correction::min3x3, Correction::safe, Correction::certified,
                                   Correction::min4};
  return kAll;
}

std::string_view correction_id(Correction correction) {
  switch (correction) {
    case Correction::none:
      return "none";
    case Correction::min3x3:
      return "min3x3";
    case Correction::safe:
      return "safe";
    case Correction::certified:
      return "certified";
    case Correction::min4:
      return "min4";
  }
  assert(false);
  return "";
}

Correction find_correction(std::string_view id) {
  std::vector<std::string_view> known;
  for (const Correction correction : corrections()) {
    if (correction_id(correction) == id) return correction;
    known.push_back(correction_id(correction));
  }
  fail_unknown("correction", id, known);
}

int given_value(std::span<const MapValue> values, const MapParam& param) {
  const auto given = std::ranges::find(values, param.id, &MapValue::param);
  return given == values.end() ? param.fallback : given->value;
}

int BakeRequest::value(const MapParam& param) const { return given_value(parameters, param); }

std::string parameters_text(const BakeRequest& request, const MapRow& map) {
  std::string text;
  for (const MapParam& param : map.parameters)
    text += fmt::format("{}{}={}", text.empty() ? "" : "&", param.id, request.value(param));
  return text;
}

void check_bakeable(const Heightfield& heights) {
  const int width = heights.width;
  const int height = heights.height;
  if (width < 2 || height < 2) fail_input("heightmap: {} x {} texels, expected at least 2 x 2", width, height);
  if (heights.texels.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    fail_input("heightmap: {} texels, expected {} x {}", heights.texels.size(), width, height);
  }
}

void check_request(const BakeRequest& request, MapKind kind) {
  check_bakeable(request.heights);
  const MapRow& row = find_map(kind);
  for (const MapValue& given : request.parameters) {
    const auto param = std::ranges::find(row.parameters, given.param, &MapParam::id);
    if (param == row.parameters.end()) fail_input("a {} map has no parameter '{}'", row.id, given.param);
    if (given.value < param->min || given.value > param->max)
      fail_input("{}: {}, expected {} to {}", param->id, given.value, param->min, param->max);
  }
  if (std::ranges::find(row.corrections, request.correction) != row.corrections.end()) return;
  std::string choices;
  for (const Correction choice : row.corrections) {
    choices += fmt::format("{}{}", choices.empty() ? "" : ", ", correction_id(choice));
  }
  fail_input("{}: no correction `{}`, expected one of {}", row.id, correction_id(request.correction), choices);
}

}  // namespace reliefbench
