#include "backends/gpu_bake_passes.h"

#include <cstring>
#include <span>
#include <utility>

#include "backends/spirv.h"
#include "kernels/maps/cell_map.h"
#include "kernels/maps/certified_cones.h"
#include "kernels/maps/cone_bounds.h"
#include "kernels/maps/solid_map.h"

namespace reliefbench {
namespace {

/// Fewer texels than this never take a device so long that its watchdog barks, but where every pair is looked at.
constexpr std::size_t kShortTexels = std::size_t{512} * 512;

int groups(int texels) { return (texels + kGroupSide - 1) / kGroupSide; }

/// Groups for a point in two along each axis.
void of_every_second(ComputePass& pass, const BakeGrid& grid) {
  pass.groups_x = groups(nodes_at(grid.width, 1));
  pass.groups_y = groups(nodes_at(grid.height, 1));
}

/// Passes over one grid of packets whose rays are walked: those that take longer than a software rasteriser lets loops
/// run go on in the next one. A pass over packets that are done takes .4 ms at 256x256.
int walk_passes(const BakeGrid& grid) { return 8 + static_cast<int>(grid.points() >> 14); }

template <typename Value>
std::vector<std::byte> bytes_of(const std::vector<Value>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

/// What a texel weighs at the points along x, then along y.
std::vector<PointWeight> weights_of(Subdivision by) {
  std::vector<PointWeight> weights = point_weights(by.x);
  const std::vector<PointWeight> along_y = point_weights(by.y);
  weights.insert(weights.end(), along_y.begin(), along_y.end());
  return weights;
}

}  // namespace

int buffers_of(std::string_view shader) {
  if (shader == kMinimumShader || shader == kRefineShader || shader == kLimitsShader || shader == kCornersShader ||
      shader == kLevelsShader)
    return 3;
  if (shader == kWalkShader) return 6;
  if (shader == kWalkPacketsShader) return 7;
  return shader == kWedgeShader || shader == kPackShader ? 5 : 4;
}

BakePasses::BakePasses(const Pipelines& pipelines, const BakeRequest& request, const Fit& fit)
    : pipelines_(pipelines),
      request_(request),
      fit_(fit),
      own_(make_grid(map_grid(request), surfaces(request.heights))) {}

std::span<const std::byte> BakePasses::surfaces(const Heightfield& heights) {
  if (!heights.is_solid()) return std::as_bytes(std::span(heights.texels));
  std::vector<float> both = heights.texels;
  both.insert(both.end(), heights.floors.begin(), heights.floors.end());
  return contents_.emplace_back(bytes_of(both));
}

int BakePasses::add_search(Grid& on, const BakeSearch& search) {
  if (search.wedges == nullptr) return add_search(on, search, {}, request_.correction);
  return add_search(on, search, bake_wedges(search.wedges(request_), on.grid, request_.wrap), request_.correction);
}

int BakePasses::add_search(Grid& on, const BakeSearch& search, const std::vector<BakeWedge>& wedges,
                           Correction metric) {
  const BakeGrid& grid = on.grid;
  layers_ = std::max(static_cast<int>(wedges.size()), 1);
  on.head = add_head(on, search, metric);
  const int pyramids = search.quadrants ? 4 : 1;
  const int quads =
      add_buffer(static_cast<std::size_t>(pyramids) * static_cast<std::size_t>(on.levels.nodes) * kBufferTexelBytes);
  const int ratios = add_ratios(grid);
  std::vector<int> buffers{on.head, on.heights, quads, ratios};
  for (int level = 1; level <= static_cast<int>(on.levels.levels.size()); ++level)
    job_.passes.push_back({.part = "pyramid",
                           .pipeline = pipeline(kPyramidShader),
                           .buffers = buffers,
                           .groups_x = groups(nodes_at(grid.width, level)),
                           .groups_y = groups(nodes_at(grid.height, level)),
                           .groups_z = pyramids,
                           .argument = level});
  if (search.walks_rays) {
    buffers.push_back(add_buffer(grid.points() * kBufferTexelBytes));
    add_pass(grid, "pyramid", kCornersShader, {on.head, on.heights, buffers.back()});
    add_walks(grid, search, std::move(buffers));
    return ratios;
  }
  if (!wedges.empty()) buffers.push_back(add_buffer(bytes_of(wedges)));
  add_search_pass(grid, search, std::move(buffers));
  return ratios;
}

int BakePasses::add_cells(const BakeSearch& search) {
  check_cells(request_);
  const auto searches = cell_searches(0);
  const auto metric = [&](std::size_t i) { return searches.at(i).is_axis ? Correction::none : Correction::safe; };
  const int ratios = add_search(own_, search, cell_wedges(0, own_.grid), metric(0));
  std::vector<int> buffers = job_.passes.back().buffers;
  for (std::size_t i = 1; i < searches.size(); ++i) {
    buffers.front() = add_head(own_, search, metric(i));
    buffers.back() = add_buffer(bytes_of(cell_wedges(i, own_.grid)));
    add_search_pass(own_.grid, search, buffers);
  }
  return ratios;
}

int BakePasses::add_head(const Grid& on, const BakeSearch& search, Correction metric) {
  BakeRequest searched = request_;
  searched.correction = metric;
  return add_buffer(search_block(searched, on.grid, search, on.levels, layers_));
}

void BakePasses::add_search_pass(const BakeGrid& grid, const BakeSearch& search, std::vector<int> buffers) {
  ComputePass& pass = add_pass(grid, "search", search.shader, std::move(buffers));
  pass.may_be_long = may_be_long(grid);
  if (search.unit == BakeUnit::packets) of_every_second(pass, grid);
}

void BakePasses::add_walks(const BakeGrid& grid, const BakeSearch& search, std::vector<int> buffers) {
  const bool has_packets = search.unit == BakeUnit::packets;
  const int width = has_packets ? nodes_at(grid.width, 1) : grid.width;
  const int height = has_packets ? nodes_at(grid.height, 1) : grid.height;
  buffers.push_back(add_ratios(grid));  // one target each
  if (has_packets)
    buffers.push_back(add_buffer(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * kSearchBytes));
  for (int stride = kWidestStride; stride > 0; stride /= 2) {
    const bool is_first = stride == kWidestStride;
    const auto made = [&](int side) { return (side - 1) / (is_first ? stride : 2 * stride) + 1; };
    for (int i = 0; i < (search.goes_on ? fit_.patience * walk_passes(grid) : 1); ++i)
      job_.passes.push_back({.part = "search",
                             .pipeline = pipeline(search.shader),
                             .buffers = buffers,
                             .groups_x = has_packets ? groups(made(width)) : made(width),
                             .groups_y = has_packets ? groups(made(height)) : made(height),
                             .groups_z = is_first ? 1 : 3,  // along x, along y, along both
                             .argument = i == 0 ? stride : -stride,
                             .may_be_long = !has_packets});  // a pass over packets ends by itself
  }
}

int BakePasses::add_mean(int first, int second) {
  const int means = add_ratios(own_.grid);
  add_pass(own_.grid, "correction", kMeanShader, {own_.head, first, second, means});
  return means;
}

int BakePasses::add_minimum(int ratios) {
  const int least = add_ratios(own_.grid);
  add_pass(own_.grid, "correction", kMinimumShader, {own_.head, ratios, least});
  return least;
}

int BakePasses::add_corrected(int ratios) {
  const bool is_least = request_.correction == Correction::min3x3 || request_.correction == Correction::safe;
  return is_least ? add_minimum(ratios) : ratios;
}

int BakePasses::add_double_cone(const BakeSearch& search) {
  const int up = add_corrected(add_search(search));
  contents_.push_back(bytes_of(mirrored_floors(request_.heights).texels));
  Grid below = make_grid(own_.grid, contents_.back());
  const int down = add_corrected(add_search(below, search));
  const int both = add_buffer(2 * own_.grid.points() * sizeof(float));
  add_pass(own_.grid, "correction", kDoubleConeShader, {own_.head, up, down, both});
  return both;
}

int BakePasses::add_chain(bool is_of_cells) {
  const BakeLevels levels = chain_levels(own_.grid.width, own_.grid.height);
  layers_ = request_.heights.is_solid() ? 2 : 1;
  const int nodes =
      add_buffer(static_cast<std::size_t>(layers_) * static_cast<std::size_t>(levels.nodes) * sizeof(float));
  const std::vector<int> buffers{add_buffer(chain_block(request_, levels, layers_, is_of_cells)), own_.heights, nodes};
  for (int level = 0; level < static_cast<int>(levels.levels.size()); ++level)
    job_.passes.push_back({.part = "pyramid",
                           .pipeline = pipeline(kLevelsShader),
                           .buffers = buffers,
                           .groups_x = groups(level_side(own_.grid.width, level)),
                           .groups_y = groups(level_side(own_.grid.height, level)),
                           .groups_z = layers_,
                           .argument = level});
  return nodes;
}

int BakePasses::add_certified(const BakeSearch& search) {
  const int of_texels = add_search(search);
  const Subdivision by = certified_points(request_.heights);
  if (!fit_.device.has_doubles) contents_.push_back(bytes_of(refine(request_.heights, request_.wrap, by).texels));
  const std::span<const std::byte> heights = fit_.device.has_doubles ? std::span<const std::byte>() : contents_.back();
  Grid finer = make_grid(finer_grid(request_, by), heights);
  if (fit_.device.has_doubles) {
    const int head = add_buffer(search_block(request_, finer.grid, search, finer.levels, 1));
    add_pass(finer.grid, "refine", kRefineShader, {head, own_.heights, finer.heights}).groups_z = 1;
  }
  const int of_points = add_search(finer, search);
  const int bounds = add_ratios(finer.grid);
  add_pass(finer.grid, "correction", kBoundsShader, {finer.head, of_points, of_texels, bounds});
  const int limits = add_ratios(finer.grid);
  add_pass(finer.grid, "correction", kLimitsShader, {finer.head, bounds, limits});
  const int raised = add_ratios(own_.grid);
  const std::vector<int> buffers{finer.head, limits, add_buffer(bytes_of(weights_of(by))), raised};
  add_pass(own_.grid, "correction", kRaiseShader, buffers).argument = kBeforeAllTurns;
  for (int turn = 0; turn < RaisingTurns(request_).count(); ++turn) {
    ComputePass& pass = add_pass(own_.grid, "correction", kRaiseShader, buffers);
    pass.argument = turn;
    of_every_second(pass, own_.grid);
  }
  return raised;
}

int BakePasses::add_radii() {
  const BakeLevels levels = shape_levels(request_.heights, request_.wrap);
  const int bake = add_buffer(radius_block(request_, levels));
  const int shapes = add_buffer(static_cast<std::size_t>(levels.nodes) * kShapeBytes);
  const int radii = add_ratios(own_.grid);
  const std::vector<int> buffers{bake, own_.heights, shapes, radii};
  for (std::size_t level = 0; level < levels.levels.size(); ++level) {
    const int width = levels.levels[level].stride;
    const int end = level + 1 < levels.levels.size() ? levels.levels[level + 1].first : levels.nodes;
    job_.passes.push_back({.part = "pyramid",
                           .pipeline = pipeline(kShapesShader),
                           .buffers = buffers,
                           .groups_x = groups(width),
                           .groups_y = groups((end - levels.levels[level].first) / width),
                           .argument = static_cast<int>(level)});
  }
  add_pass(own_.grid, "search", kRadiusShader, buffers).may_be_long = may_be_long(own_.grid);
  return add_corrected(radii);
}

int BakePasses::add_safety_shape(int ratios, int radii) {
  const int both = add_buffer(2 * std::span(request_.heights.texels).size_bytes());
  add_pass(own_.grid, "pack", kSafetyShapeShader, {own_.head, ratios, radii, both});
  return both;
}

int BakePasses::add_packed(int values, const PackPlan& plan) {
  constexpr int kGroupsAcross = 1024;  // of those that have no place
  constexpr int kOfGroup = kGroupSide * kGroupSide;
  const int head = add_buffer(search_block(request_, own_.grid, {}, own_.levels, 1));
  const int words = add_buffer(static_cast<std::size_t>(plan.words) * sizeof(std::uint32_t));
  const auto add = [&](const BakePack& pack, int invocations, int argument) {
    const int count = (invocations + kOfGroup - 1) / kOfGroup;
    const int across = std::min(count, kGroupsAcross);
    job_.passes.push_back({.part = "pack",
                           .pipeline = pipeline(kPackShader),
                           .buffers = {head, add_buffer(bytes_of(std::vector{pack})), own_.heights, values, words},
                           .groups_x = across,
                           .groups_y = (count + across - 1) / across,
                           .argument = argument});
  };
  add(plan.textures.front(), 1, kClearFlag);
  for (const BakePack& pack : plan.textures) add(pack, pack_invocations(pack), 0);
  return words;
}

ComputeJob BakePasses::job(int result) const {
  ComputeJob whole = job_;
  whole.result = result;
  return whole;
}

BakePasses::Grid BakePasses::make_grid(const BakeGrid& grid, std::span<const std::byte> heights) {
  const int place = add_buffer(std::max(grid.points() * sizeof(float), heights.size()));
  job_.buffers.back().contents = heights;
  return {.grid = grid, .levels = quad_levels(grid.width, grid.height), .heights = place};
}

bool BakePasses::may_be_long(const BakeGrid& grid) const {
  return fit_.sees_pairs || grid.points() * static_cast<std::size_t>(layers_) > kShortTexels;
}

ComputePass& BakePasses::add_pass(const BakeGrid& grid, std::string_view part, std::string_view shader,
                                  std::vector<int> buffers) {
  return job_.passes.emplace_back(ComputePass{.part = part,
                                              .pipeline = pipeline(shader),
                                              .buffers = std::move(buffers),
                                              .groups_x = groups(grid.width),
                                              .groups_y = groups(grid.height),
                                              .groups_z = layers_});
}

int BakePasses::add_buffer(std::size_t bytes) {
  job_.buffers.push_back({.bytes = bytes});
  return static_cast<int>(job_.buffers.size()) - 1;
}

int BakePasses::add_buffer(std::vector<std::byte> contents) {
  contents_.push_back(std::move(contents));
  const int place = add_buffer(contents_.back().size());
  job_.buffers.back().contents = contents_.back();
  return place;
}

int BakePasses::add_ratios(const BakeGrid& grid) {
  return add_buffer(static_cast<std::size_t>(layers_) * grid.points() * sizeof(float));
}

}  // namespace reliefbench
