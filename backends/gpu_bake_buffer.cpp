#include "backends/gpu_bake_buffer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

#include "kernels/base/rounding.h"
#include "kernels/maps/certified_cones.h"
#include "kernels/maps/cone_bounds.h"
#include "kernels/maps/cone_search.h"
#include "kernels/maps/solid_map.h"

namespace reliefbench {
namespace {

constexpr int kLeastShape = 4;  // cells along the least node of shapes

/// Head of the Bake block of bake_common.glsl, laid out by std140; the levels follow.
struct BakeHead {
  double weight_x = 1;
  double weight_y = 1;
  double slack = 0;
  double side = 1;
  double widest_key = 0;
  double diagonal = 0;
  float aspect = 1;
  float slack_in_rows = 0;
  float widest_in_rows = 0;
  float rows_to_ratio = 0;
  std::array<std::int32_t, 2> size{};
  std::int32_t top_level = 0;
  std::int32_t pyramids = 1;
  std::int32_t pyramid_quads = 0;
  std::int32_t layers = 1;
  std::int32_t repeats = 0;
  std::int32_t exact_distances = 0;
  std::int32_t is_of_cells = 0;
  std::int32_t search_steps = 0;
  float step_share = 1;
  std::int32_t is_interpolated = 0;
  float guard = 0;
  float max_ratio = 1;
  std::array<std::int32_t, 2> by{1, 1};
};
static_assert(sizeof(BakeHead) % alignof(BakeLevel) == 0);
/// Of one search on a pyramid of quads.
BakeHead head_of(const BakeRequest& request, const BakeGrid& grid, const BakeSearch& search, const BakeLevels& levels,
                 int layers) {
  const ConeMetric metric = cone_metric(grid.uv_width, grid.uv_height, request.correction);
  const double widest = metric.side * static_cast<double>(grid.max_ratio);
  const int side = std::max(grid.width, grid.height);
  // Squares of up to a whole side, in halves of a texel, are to be whole numbers of 24 bits.
  const bool is_exact = metric.weight_x == metric.weight_y && side <= 1448;
  const double to_ratio = std::sqrt(metric.weight_y) / metric.side * (1 - 1e-6);  // over the roots' rounding
  return {.weight_x = metric.weight_x,
          .weight_y = metric.weight_y,
          .slack = metric.slack,
          .side = metric.side,
          .widest_key = widest * widest,
          .diagonal = std::hypot(1.0 / grid.uv_width, 1.0 / grid.uv_height),
          .aspect = static_cast<float>(metric.weight_x / metric.weight_y),
          .slack_in_rows = static_cast<float>(metric.slack / metric.weight_y),
          .widest_in_rows = static_cast<float>(widest * widest / metric.weight_y),
          .rows_to_ratio = rounded_down(to_ratio),
          .size = {grid.width, grid.height},
          .top_level = static_cast<std::int32_t>(levels.levels.size()),
          .pyramids = search.quadrants ? 4 : 1,
          .pyramid_quads = levels.nodes,
          .layers = layers,
          .repeats = request.wrap == Wrap::repeat ? 1 : 0,
          .exact_distances = is_exact ? 1 : 0,
          .search_steps = request.value(kSearchSteps),
          .step_share = 1 / static_cast<float>(request.value(kSearchSteps)),
          .is_interpolated = request.correction == Correction::none ? 0 : 1,
          .guard = grid.guard,
          .max_ratio = request.max_ratio,
          .by = {grid.by.x, grid.by.y}};
}

/// Of the search for radii, on a pyramid of shapes: distances are as they are, whatever the correction.
BakeHead radius_head(const BakeRequest& request, const BakeLevels& levels) {
  BakeRequest apart = request;
  apart.correction = Correction::none;
  BakeHead head = head_of(apart, map_grid(apart), {}, levels, 1);
  head.top_level -= 1;
  head.is_interpolated = request.correction == Correction::none ? 0 : 1;
  return head;
}

/// Bytes of the Bake block.
std::vector<std::byte> bake_block(const BakeHead& head, const BakeLevels& levels) {
  assert(levels.levels.size() <= kMostLevels);
  std::vector<std::byte> bytes(sizeof head + kMostLevels * sizeof(BakeLevel));
  std::memcpy(bytes.data(), &head, sizeof head);
  std::memcpy(bytes.data() + sizeof head, levels.levels.data(), std::span(levels.levels).size_bytes());
  return bytes;
}

}  // namespace

std::string bake_contract(BakeDevice device, BakeFootpoint footpoint) {
  std::string text;
  const auto add = [&](std::string_view name, int value) { text += fmt::format("#define {} {}\n", name, value); };
  add("GROUP_SIDE", kGroupSide);
  add("DISPATCH_BINDING", kDispatchBinding);
  add("FIRST_BUFFER_BINDING", kFirstBufferBinding);
  add("WIDEST_STRIDE", kWidestStride);
  add("LEAST_NODE", kLeastShape);
  add("MOST_LEVELS", static_cast<int>(kMostLevels));
  add("BEFORE_ALL_TURNS", kBeforeAllTurns);
  add("FOOTPOINT_NEAREST", static_cast<int>(BakeFootpoint::nearest));      // the nearest one
  add("FOOTPOINT_UNVISITED", static_cast<int>(BakeFootpoint::unvisited));  // of those that no finer level has visited
  add("FOOTPOINT_PUBLISHED", static_cast<int>(BakeFootpoint::published));
  add("FOOTPOINT_CENTRE", static_cast<int>(BakeFootpoint::centre));
  add("FOOTPOINT", static_cast<int>(footpoint));
  text += fmt::format("#define RAISING_GUARD {:.9f}\n", kRaisingGuard);
  text += fmt::format("#define MIRROR_ERROR {:.17g}lf\n", kMirrorError);
  text += fmt::format("#define CUT_SHORT {:.1f}\n", kCutShort);
  if (device.has_doubles) text += "#define HAS_DOUBLES\n";
  return text;
}

BakeGrid map_grid(const BakeRequest& request) {
  const auto [width, height] = std::pair(request.heights.width, request.heights.height);
  return {.width = width, .height = height, .uv_width = width, .uv_height = height, .max_ratio = request.max_ratio};
}

BakeGrid finer_grid(const BakeRequest& request, Subdivision by) {
  const auto [width, height] = std::pair(request.heights.width, request.heights.height);
  return {.width = fine_side(width, by.x, request.wrap),
          .height = fine_side(height, by.y, request.wrap),
          .uv_width = width * by.x,
          .uv_height = height * by.y,
          .by = by,
          .max_ratio = request.max_ratio * kBoundsBeyond,
          .guard = rise_guard(request.heights, by, Correction::safe)};
}

BakeLevels quad_levels(int width, int height) {
  BakeLevels all;
  for (int level = 1;; ++level) {
    all.add(nodes_at(width, level), nodes_at(height, level));
    if (nodes_at(width, level) == 1 && nodes_at(height, level) == 1) return all;
  }
}

BakeLevels chain_levels(int width, int height) {
  BakeLevels all;
  for (int level = 0; level == 0 || std::max(width, height) >> level > 0; ++level)
    all.add(level_side(width, level), level_side(height, level));
  return all;
}

BakeLevels shape_levels(const Heightfield& heights, Wrap wrap) {
  const int border = wrap == Wrap::clamp ? 1 : 0;
  BakeLevels all;
  for (int side = kLeastShape;; side *= 2) {
    const int width = (heights.width + border + side - 1) / side;
    const int height = (heights.height + border + side - 1) / side;
    all.add(width, height);
    if (width == 1 && height == 1) return all;
  }
}

std::vector<std::byte> search_block(const BakeRequest& request, const BakeGrid& grid, const BakeSearch& search,
                                    const BakeLevels& levels, int layers) {
  return bake_block(head_of(request, grid, search, levels, layers), levels);
}

std::vector<std::byte> chain_block(const BakeRequest& request, const BakeLevels& levels, int layers, bool is_of_cells) {
  BakeHead head = head_of(request, map_grid(request), {}, levels, layers);
  head.is_of_cells = is_of_cells ? 1 : 0;
  return bake_block(head, levels);
}

std::vector<std::byte> radius_block(const BakeRequest& request, const BakeLevels& levels) {
  return bake_block(radius_head(request, levels), levels);
}

}  // namespace reliefbench
