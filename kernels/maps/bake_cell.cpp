#include <algorithm>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/maps/cell_map.h"

namespace reliefbench {
namespace {

/// The tops of the cells at their corners: texel (x, y) has that of the cell whose corner it is. Where there is no such
/// cell nothing is higher.
Heightfield at_corners(const Heightfield& heights, const std::vector<float>& tops, Wrap wrap,
                       const CellCorner& corner) {
  Heightfield owners{.width = heights.width, .height = heights.height, .texels = std::vector<float>(tops.size(), 1.0F)};
  for (int y = 0; y < heights.height; ++y) {
    for (int x = 0; x < heights.width; ++x) {
      const int i = x - corner.x;
      const int j = y - corner.y;
      if (wrap == Wrap::clamp && (i < 0 || j < 0)) continue;
      owners.texels[owners.index(x, y)] =
          tops[owners.index(wrapped(i, heights.width, wrap), wrapped(j, heights.height, wrap))];
    }
  }
  return owners;
}

/// The ratio of each cell, from the one that was found at its corner.
void keep_least(std::vector<float>& cells, const std::vector<float>& at_corner, const Heightfield& heights, Wrap wrap,
                const CellCorner& corner) {
  for (int y = 0; y < heights.height; ++y)
    for (int x = 0; x < heights.width; ++x) {
      float& least = cells[heights.index(x, y)];
      least = std::min(least, at_corner[heights.index(wrapped(x + corner.x, heights.width, wrap),
                                                      wrapped(y + corner.y, heights.height, wrap))]);
    }
}

/// The axis from a corner towards (x, y), one of which is 0.
Wedge axis(double x, double y) {
  const double across_x = y == 0 ? 0 : 1;
  const double across_y = x == 0 ? 0 : 1;
  return {.normals = {{{.x = x, .y = y}, {.x = across_x, .y = across_y}, {.x = -across_x, .y = -across_y}}},
          .quadrant = {.x = x, .y = y}};
}

}  // namespace

std::vector<float> cell_tops(const Heightfield& heights, Wrap wrap, int threads) {
  std::vector<float> tops(heights.texels.size());
  parallel_for(heights.height, threads, [&](int y) {
    const int above = wrapped(y + 1, heights.height, wrap);
    for (int x = 0; x < heights.width; ++x) {
      const int right = wrapped(x + 1, heights.width, wrap);
      tops[heights.index(x, y)] =
          std::max({heights.at(x, y), heights.at(right, y), heights.at(x, above), heights.at(right, above)});
    }
  });
  return tops;
}

std::array<CellSearch, 3> cell_searches(int quarter) {
  const CellCorner outer{.x = (quarter & 1) == 0 ? 1 : 0, .y = (quarter & 2) == 0 ? 1 : 0};
  const double to_x = 2 * outer.x - 1;
  const double to_y = 2 * outer.y - 1;
  return {{{.corner = outer,
            .wedge = {.normals = {{{.x = to_x, .y = 0}, {.x = 0, .y = to_y}}}, .quadrant = {.x = to_x, .y = to_y}}},
           {.corner = {.x = outer.x, .y = 1 - outer.y}, .wedge = axis(to_x, 0), .is_axis = true},
           {.corner = {.x = 1 - outer.x, .y = outer.y}, .wedge = axis(0, to_y), .is_axis = true}}};
}

// Theorem: from every point p over a cell, at its top's height, the cone with the cell's ratio holds no point of the
// bilinear surface in its quarter of the directions. Say the quarter of +x and +y, c the corner of the cell farthest
// that way, and q a point of the surface whose offset from p has no negative coordinate. Then q is
// - in the cell, where nothing is over its top;
// - in the strip before its right side, d texels away, and so no nearer to p. Its cell's corners have whole distances
//   from the side; each may rise over the top by its distance over the ratio, and their interpolation, linear in the
//   distance, by d over it. Likewise in the strip above;
// - or at an offset from c without a negative coordinate, and c is the nearest point of the cell. Raise the map's texel
//   c to the top: the surface is nowhere lower then, and by the theorem at Correction, in the quarter (as bake_sector
//   has it), the cone of ratio S_c at c holds none of it.
// The search from c with the distances of `safe` is the last; that of the strips' outer rows is among it. The inner
// rows are seen from the two other corners, at their whole distances. Beyond a clamped map each point has the height of
// the nearest one on the map; moving p and q there leaves signs as they are and adds nothing to their distance.
std::vector<float> cell_cones(const BakeRequest& request, const std::vector<float>& tops, const ConeMetric& metric) {
  const Heightfield& heights = request.heights;
  const Wrap wrap = request.wrap;
  const ConeMetric whole = cone_metric(heights.width, heights.height, Correction::none);
  std::vector<float> layers;
  layers.reserve(kQuarters * tops.size());
  for (int k = 0; k < kQuarters; ++k) {
    std::vector<float> layer(tops.size(), request.max_ratio);
    for (const auto& [corner, wedge, is_axis] : cell_searches(k)) {
      const Heightfield owners = at_corners(heights, tops, wrap, corner);
      keep_least(layer,
                 search_cones({.heights = owners,
                               .wrap = wrap,
                               .metric = is_axis ? whole : metric,
                               .max_ratio = request.max_ratio,
                               .views = {wedge_view(heights, heights.width, heights.height, wedge, 0)},
                               .threads = request.threads}),
                 heights, wrap, corner);
    }
    layers.insert(layers.end(), layer.begin(), layer.end());
  }
  return layers;
}

void check_cells(const BakeRequest& request) {
  check_request(request, MapKind::cell);
  if (request.max_ratio > 1) fail_input("ratios of a cell map are at most 1");
}

std::vector<float> bake_cell(const BakeRequest& request) {
  check_cells(request);
  const Heightfield& heights = request.heights;
  return cell_cones(request, cell_tops(heights, request.wrap, request.threads),
                    cone_metric(heights.width, heights.height, Correction::safe));
}

}  // namespace reliefbench
