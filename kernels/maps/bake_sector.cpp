#include <cassert>

#include "kernels/base/error.h"
#include "kernels/image/image.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/sector_map.h"

namespace reliefbench {
namespace {

// Whole numbers on either side of tan(pi / 8) = 0.414213562: 70/169 = 0.414201, 29/70 = 0.414286. The shader's product
// is off by 1e-7 of it at most.
struct Slope {
  double rise, run;
};
constexpr Slope kUnderTangent{.rise = 70, .run = 169};
constexpr Slope kOverTangent{.rise = 29, .run = 70};
static_assert(kUnderTangent.rise / kUnderTangent.run < 0.41421);
static_assert(kOverTangent.rise / kOverTangent.run > 0.41428);

/// The borders before what looks towards a quadrant, or behind it (-x, -y).
class Borders {
 public:
  Borders(const Heightfield& map, double x, double y) : column_(end(map.width, x)), row_(end(map.height, y)) {}
  [[nodiscard]] bool have(int x, int y) const { return x == column_ || y == row_; }

 private:
  static constexpr int kNone = -1;
  static int end(int side, double sign) {
    if (sign == 0) return kNone;
    return sign > 0 ? side - 1 : 0;
  }
  int column_, row_;
};

/// The targets of a border in front of what looks in a quadrant.
Heightfield far_borders(const Heightfield& candidates, const ConeView::Normal& quadrant) {
  Heightfield targets = candidates;
  const Borders borders(candidates, quadrant.x, quadrant.y);
  auto texel = targets.texels.begin();
  for (int y = 0; y < targets.height; ++y)
    for (int x = 0; x < targets.width; ++x, ++texel)
      if (!borders.have(x, y)) *texel = -1;
  return targets;
}

/// Ratios of one sector after the other, as `ratios_of` has them.
template <typename Ratios>
std::vector<float> layers(const BakeRequest& request, const std::vector<MarginedWedge>& wedges,
                          const Ratios& ratios_of) {
  std::vector<float> all;
  all.reserve(wedges.size() * request.heights.texels.size());
  for (const auto& [wedge, margin] : wedges) {
    const std::vector<float> layer = ratios_of(wedge, margin);
    all.insert(all.end(), layer.begin(), layer.end());
  }
  return all;
}

ConeSearch search_of(const BakeRequest& request) {
  const Heightfield& heights = request.heights;
  return {.heights = heights,
          .wrap = request.wrap,
          .metric = cone_metric(heights.width, heights.height, request.correction),
          .max_ratio = request.max_ratio,
          .threads = request.threads};
}

std::vector<float> with_minimum(std::vector<float> ratios, const BakeRequest& request) {
  if (request.correction == Correction::none) return ratios;
  return min3x3(ratios, request.heights.width, request.heights.height, request.wrap);
}

}  // namespace

int sector_count(std::span<const MapValue> parameters) { return 4 << given_value(parameters, kSectors); }

bool has_opposite_ratios(std::span<const MapValue> parameters) { return given_value(parameters, kRatiosATexel) == 1; }

Wedge sector_wedge(int k, int count) {
  assert(k >= 0 && k < count);
  const double x = (k & 1) == 0 ? 1 : -1;
  const double y = (k & 2) == 0 ? 1 : -1;
  Wedge wedge{.normals = {{{x, 0}, {0, y}}}, .quadrant = {x, y}};
  if (count == 4) return wedge;
  const bool is_steep = (k & 4) != 0;
  const auto normal = [&](double along, double across) {
    return is_steep ? ConeView::Normal{.x = x * across, .y = y * along}
                    : ConeView::Normal{.x = x * along, .y = y * across};
  };
  if (count == 8) {
    wedge.normals[2] = normal(1, -1);
  } else if ((k & 8) == 0) {
    wedge.normals[2] = normal(kOverTangent.rise, -kOverTangent.run);
  } else {
    wedge.normals[2] = normal(1, -1);
    wedge.normals[3] = normal(-kUnderTangent.rise, kUnderTangent.run);
  }
  return wedge;
}

std::vector<MarginedWedge> relaxed_sector_wedges(const BakeRequest& request) {
  if (request.max_ratio > 1) fail_input("ratios of a sector map are at most 1");
  const int count = sector_count(request.parameters);
  std::vector<MarginedWedge> all;
  all.reserve(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    const Wedge wedge = sector_wedge(k, count);
    all.push_back({.wedge = wedge, .margin = wedge.safe_margin});
  }
  return all;
}

std::vector<MarginedWedge> sector_wedges(const BakeRequest& request) {
  std::vector<MarginedWedge> all = relaxed_sector_wedges(request);
  if (request.correction != Correction::safe)
    for (MarginedWedge& one : all) one.margin = 0;
  return all;
}

SectorAtlas::SectorAtlas(int count, int map_width, int map_height)
    : columns(count == 4 ? 2 : 4),
      rows(count / columns),
      width(columns * (map_width + 2)),
      height(rows * (map_height + 2)) {
  if (width > kMaxSide || height > kMaxSide)
    fail_input("{} layers of {}x{} texels are a texture of {}x{}, expected at most {} a side", count, map_width,
               map_height, width, height, kMaxSide);
}

std::vector<float> search_wedge(const ConeSearch& search, const Heightfield& candidates, int width, int height,
                                const Wedge& wedge, double margin) {
  const auto [x, y] = wedge.quadrant;
  ConeSearch seen = search;
  seen.views = {wedge_view(candidates, width, height, wedge, margin)};
  if (!is_bounded(wedge, search.wrap)) return search_cones(seen);
  const auto quadrant_of = [x = static_cast<int>(x), y = static_cast<int>(y)](const Heightfield& targets) {
    return quadrant_view(targets, x, y);
  };
  const Heightfield borders = far_borders(candidates, wedge.quadrant);
  seen.views.push_back(quadrant_of(borders));
  std::vector<float> ratios = search_cones(seen);
  seen.views = {quadrant_of(candidates)};
  const std::vector<float> of_quadrant = search_cones(seen);
  const Borders behind(candidates, -x, -y);
  std::size_t texel = 0;
  for (int j = 0; j < candidates.height; ++j)
    for (int i = 0; i < candidates.width; ++i, ++texel)
      if (behind.have(i, j)) ratios[texel] = of_quadrant[texel];
  return ratios;
}

// What makes `safe` true in a sector. Theorem: let S_a be as at Correction, but over the texels b alone whose offset
// from a, less than one texel per axis moved, is in the sector. If every ratio is at most the 3x3 minimum of S, then at
// every point p the part of its interpolated cone that lies in the sector is disjoint from the bilinear surface.
// Proof: let q be a point of the surface whose offset o from p is in the sector. The coupling of the theorem at
// Correction pairs corners a of p's cell and b of q's cell; per axis their offset is one of the two whole numbers round
// o's, which is o itself where that is whole. So it is less than one texel from o, b counts for a, and the proof goes
// on with these pairs only. A normal n of the sector has n.o >= 0, so n.(b - a) > -(|n.x| + |n.y|), where only whole
// numbers can stand: with n = (1, 0) that is b.x >= a.x, so that nothing behind an axis counts. Directions are in uv,
// where a texel is not square; half-planes stay half-planes. Of what lies outside a clamped map see search_wedge.
std::vector<float> bake_sector(const BakeRequest& request) {
  check_request(request, MapKind::sector);
  return layers(request, sector_wedges(request), [&](const Wedge& wedge, double margin) {
    return wedge_cones(request, {.wedge = wedge, .margin = margin});
  });
}

std::vector<float> wedge_cones(const BakeRequest& request, const MarginedWedge& margined) {
  if (request.correction == Correction::certified) return certified_cones(request, margined.wedge);
  const Heightfield& heights = request.heights;
  return with_minimum(
      search_wedge(search_of(request), heights, heights.width, heights.height, margined.wedge, margined.margin),
      request);
}

std::vector<float> bake_sector_relaxed(const BakeRequest& request) {
  check_request(request, MapKind::sector_relaxed);
  const Heightfield& heights = request.heights;
  const ConeSearch search = search_of(request);
  return layers(request, relaxed_sector_wedges(request), [&](const Wedge& wedge, double margin) {
    const auto [x, y] = wedge.quadrant;
    const Heightfield limiting = limiting_heights(heights, request.wrap, static_cast<int>(x), static_cast<int>(y));
    return with_minimum(search_wedge(search, limiting, heights.width, heights.height, wedge, margin), request);
  });
}

}  // namespace reliefbench
