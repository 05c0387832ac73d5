#include "kernels/map_kind.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <string>

#include "kernels/cone_map.h"
#include "kernels/error.h"

namespace reliefbench {
namespace {

constexpr std::array kNone{Correction::none};
constexpr std::array kConservative{Correction::none, Correction::min3x3, Correction::safe};
constexpr std::array kRelaxed{Correction::none, Correction::min3x3};

std::vector<float> bake_nothing(const BakeRequest& request) {
  check_bakeable(request.heights);
  return {};
}

constexpr std::array kMaps{
    MapRow{.kind = MapKind::height,
           .id = "height",
           .description = "heights alone",
           .source = "[RTM]",
           .guarantee = "",
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
           .parameter = "search_steps",
           .bake = bake_relaxed_po07,
           .version = 1},
};

}  // namespace

std::span<const MapRow> map_kinds() { return kMaps; }

const MapRow& find_map(MapKind kind) {
  const auto* row = std::ranges::find(kMaps, kind, &MapRow::kind);
  assert(row != kMaps.end());
  return *row;
}

const MapRow& find_map(std::string_view id) {
  const auto* row = std::ranges::find(kMaps, id, &MapRow::id);
  if (row != kMaps.end()) return *row;
  std::string choices;
  for (const MapRow& candidate : kMaps) choices += fmt::format("{}{}", choices.empty() ? "" : ", ", candidate.id);
  fail_input("unknown map kind '{}'; the choices are {}", id, choices);
}

std::span<const Correction> corrections() {
  static constexpr std::array kAll{Correction::none, Correction::min3x3, Correction::safe};
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
  }
  assert(false);
  return "";
}

Correction find_correction(std::string_view id) {
  std::string choices;
  for (const Correction candidate : corrections()) {
    if (correction_id(candidate) == id) return candidate;
    choices += fmt::format("{}{}", choices.empty() ? "" : ", ", correction_id(candidate));
  }
  fail_input("unknown correction '{}'; the choices are {}", id, choices);
}

void check_bakeable(const Heightfield& heights) {
  const int width = heights.width;
  const int height = heights.height;
  if (width < 2 || height < 2) fail_input("heightmap: {} x {} texels, expected at least 2 x 2", width, height);
  if (heights.texels.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    fail_input("heightmap: {} texels, expected {} x {}", heights.texels.size(), width, height);
  }
}

}  // namespace reliefbench
