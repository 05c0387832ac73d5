#include "backends/gpu_bake_wedge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/maps/sector_map.h"

namespace reliefbench {
namespace {

BakeWedge bake_wedge(const MarginedWedge& margined, const BakeRequest& request) {
  const auto [width, height] = std::pair(request.heights.width, request.heights.height);
  const ConeView view = wedge_view(request.heights, width, height, margined.wedge, margined.margin);
  const auto [x, y] = margined.wedge.quadrant;
  const bool is_whole = margined.wedge.normals[2].x == 0 && margined.wedge.normals[2].y == 0;
  BakeWedge wedge{.quadrant = {static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)},
                  .is_bounded = request.wrap == Wrap::clamp && x != 0 && !is_whole ? 1 : 0};
  for (std::size_t i = 0; i < view.normals.size(); ++i) {
    const auto [across, along] = view.normals.at(i);
    const double length = std::abs(across) + std::abs(along);
    // Twice the way to the middle of a node of an image two tiles away, a node being up to two sides long, and that.
    constexpr int kFarthestSides = 12;
    if (length * kFarthestSides * std::max(width, height) > std::numeric_limits<std::int32_t>::max())
      fail_environment(
          "{}x{} texels, whose sides have no large divisor in common, are too many for a GPU's baker of cones by "
          "direction; the CPU bakes them",
          width, height);
    wedge.normals.at(i) = {static_cast<std::int32_t>(across), static_cast<std::int32_t>(along)};
    wedge.least.at(i) = static_cast<std::int32_t>(std::ceil(-view.margin * length));
  }
  return wedge;
}

}  // namespace

std::vector<MarginedWedge> quad_wedges(const BakeRequest& request) {
  const double margin = request.correction == Correction::safe ? 1 : 0;
  std::vector<MarginedWedge> all;
  all.reserve(kQuadWedges.size());
  for (const Wedge& wedge : kQuadWedges) all.push_back({.wedge = wedge, .margin = margin});
  return all;
}

std::vector<MarginedWedge> sector_wedges(const BakeRequest& request) {
  std::vector<MarginedWedge> all;
  for (const Wedge& wedge : all_sector_wedges(request))
    all.push_back({.wedge = wedge, .margin = request.correction == Correction::safe ? wedge.safe_margin : 0});
  return all;
}

std::vector<MarginedWedge> relaxed_sector_wedges(const BakeRequest& request) {
  std::vector<MarginedWedge> all;
  for (const Wedge& wedge : all_sector_wedges(request)) all.push_back({.wedge = wedge, .margin = wedge.safe_margin});
  return all;
}

std::vector<BakeWedge> bake_wedges(const std::vector<MarginedWedge>& margined, const BakeRequest& request) {
  std::vector<BakeWedge> wedges;
  wedges.reserve(margined.size());
  for (const MarginedWedge& wedge : margined) wedges.push_back(bake_wedge(wedge, request));
  return wedges;
}

}  // namespace reliefbench
