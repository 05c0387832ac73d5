#include "kernels/cone_map.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <numeric>

#include "kernels/cone_search.h"
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
           .channels = 1,
           .corrections = kNone,
           .has_search_steps = false,
           .bake = bake_nothing,
           .version = 1},
    MapRow{.kind = MapKind::conservative,
           .id = "conservative",
           .description = "widest cone of each texel that holds no texel above",
           .source = "[DUM06]",
           .guarantee = "a cone contains no texel centre's surface point; with `safe`, no point of the surface",
           .channels = 2,
           .corrections = kConservative,
           .has_search_steps = false,
           .bake = bake_conservative,
           .version = 1},
    MapRow{.kind = MapKind::relaxed_po07,
           .id = "relaxed_po07",
           .description = "cones inside which a ray from the top plate enters the relief at most once",
           .source = "[PO07] listings 18-1 and 18-2",
           .guarantee = "a ray from the top plate over a texel, towards another texel's surface point, does not leave "
                        "the relief within the cone, as far as the search's steps see",
           .channels = 2,
           .corrections = kRelaxed,
           .has_search_steps = true,
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

std::vector<float> min3x3(std::span<const float> ratios, int width, int height, Wrap wrap) {
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(wrapped(y, height, wrap)) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(wrapped(x, width, wrap));
  };
  // The minimum is separable: along the rows, then along the columns.
  std::vector<float> rows(ratios.size());
  std::vector<float> result(ratios.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      rows[index(x, y)] = std::min({ratios[index(x - 1, y)], ratios[index(x, y)], ratios[index(x + 1, y)]});
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      result[index(x, y)] = std::min({rows[index(x, y - 1)], rows[index(x, y)], rows[index(x, y + 1)]});
    }
  }
  return result;
}

void check_bakeable(const Heightfield& heights) {
  const int width = heights.width;
  const int height = heights.height;
  if (width < 2 || height < 2) fail_input("heightmap: {} x {} texels, expected at least 2 x 2", width, height);
  if (heights.texels.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    fail_input("heightmap: {} texels, expected {} x {}", heights.texels.size(), width, height);
  }
}

ConeMetric cone_metric(int width, int height, Correction correction) {
  const int common = std::gcd(width, height);
  const double x = height / common;  // NOLINT(bugprone-integer-division): divides
  const double y = width / common;   // NOLINT(bugprone-integer-division): divides
  ConeMetric metric{.weight_x = x * x, .weight_y = y * y, .slack = 0, .side = x * width};
  if (correction != Correction::safe) return metric;
  // On a long map the theorem's slack swallows the step along the finer side, and the cones of most texels close.
  // d^2 / 2 is safe whatever the texels' shape: d <= |x| + |y| per axis, and those expectations are exact.
  if (std::max(x, y) > 1.5 * std::min(x, y)) {
    metric.weight_x /= 2;
    metric.weight_y /= 2;
  } else {
    metric.slack = (metric.weight_x + metric.weight_y) / 4;
  }
  return metric;
}

}  // namespace reliefbench
