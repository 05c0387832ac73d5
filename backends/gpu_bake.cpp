#include "backends/gpu_bake.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "backends/shader_compiler.h"
#include "kernels/cone_search.h"
#include "kernels/error.h"
#include "kernels/max_pyramid.h"

namespace reliefbench {
namespace {

constexpr int kGroupSide = 8;  // texels, as in bake_common.glsl

using Bytes = std::vector<std::byte>;

/// Head of the Bake buffer of bake_common.glsl; the levels follow.
struct BakeHead {
  double weight_x = 1;
  double weight_y = 1;
  double slack = 0;
  double widest_key = 0;
  std::array<std::int32_t, 2> size{};
  std::int32_t root = 0;
  std::int32_t search_steps = 0;
  std::int32_t pyramids = 1;
  std::int32_t pyramid_nodes = 0;
  std::int32_t heights = 0;
  std::int32_t repeats = 0;
};
struct BakeLevel {
  std::int32_t first_node, stride;
};

BakeHead head_of(const BakeRequest& request) {
  const Heightfield& heights = request.heights;
  const ConeMetric metric = cone_metric(heights.width, heights.height, request.correction);
  const double widest = metric.side * static_cast<double>(request.max_ratio);
  return {.weight_x = metric.weight_x,
          .weight_y = metric.weight_y,
          .slack = metric.slack,
          .widest_key = widest * widest,
          .size = {heights.width, heights.height},
          .search_steps = request.search_steps,
          .repeats = request.wrap == Wrap::repeat ? 1 : 0};
}

template <typename T>
void append(Bytes& bytes, std::span<const T> values) {
  const auto added = std::as_bytes(values);
  bytes.insert(bytes.end(), added.begin(), added.end());
}

/// The nodes of all levels, level 0 first, and where each level begins in a pyramid.
void append(Bytes& nodes, std::vector<BakeLevel>& levels, const MaxPyramid& pyramid) {
  std::size_t node = 0;
  levels.clear();
  for (const MaxPyramid::Level& level : pyramid.levels()) {
    levels.push_back(
        {.first_node = static_cast<std::int32_t>(node), .stride = static_cast<std::int32_t>(level.stride)});
    node += level.nodes.size();
    append<float>(nodes, level.nodes);
  }
}

/// Input buffers of the shaders that search all texels.
std::vector<Bytes> search_inputs(const BakeRequest& request) {
  Bytes nodes;
  std::vector<BakeLevel> levels;
  append(nodes, levels, MaxPyramid(request.heights));
  BakeHead head = head_of(request);
  head.root = static_cast<std::int32_t>(levels.size()) - 1;
  Bytes bake;
  append<BakeHead>(bake, {&head, 1});
  append<BakeLevel>(bake, levels);
  return {std::move(bake), std::move(nodes)};
}

struct Row {
  MapKind kind;
  std::string_view shader;  ///< name of the .comp file
  int inputs;               ///< buffers
  std::vector<Bytes> (*make_inputs)(const BakeRequest& request);
};
constexpr std::array kRows{
    Row{.kind = MapKind::conservative, .shader = "bake_exact", .inputs = 2, .make_inputs = search_inputs},
    Row{.kind = MapKind::relaxed_po07, .shader = "bake_relaxed_po07", .inputs = 2, .make_inputs = search_inputs},
};

const Row& find_row(MapKind kind) {
  const auto* row = std::ranges::find(kRows, kind, &Row::kind);
  if (row == kRows.end()) fail_input("{}: no GPU baker", find_map(kind).id);
  return *row;
}

void check_request(const MapRow& row, const BakeRequest& request) {
  check_bakeable(request.heights);
  if (request.search_steps < 1) fail_input("search_steps: {}, expected at least 1", request.search_steps);
  if (std::ranges::find(row.corrections, request.correction) == row.corrections.end())
    fail_input("{}: no correction `{}`", row.id, correction_id(request.correction));
}

int groups(int texels) { return (texels + kGroupSide - 1) / kGroupSide; }

}  // namespace

std::span<const MapKind> gpu_bakers() {
  static const auto kinds = [] {
    std::array<MapKind, kRows.size()> list{};
    std::ranges::transform(kRows, list.begin(), &Row::kind);
    return list;
  }();
  return kinds;
}

GpuBaker::GpuBaker(Backend& backend, Dialect dialect, MapKind kind) : backend_(backend), kind_(kind) {
  const Row& row = find_row(kind);
  const DeviceInfo& device = backend.device();
  if (!device.float64) fail_environment("{}: no double precision in shaders, which a bake needs", device.name);
  const Spirv spirv = compile_compute(row.shader, dialect);
  pipeline_ = backend.compile_compute({.label = std::string(find_map(kind).id), .spirv = spirv, .inputs = row.inputs});
}

std::vector<float> GpuBaker::bake(const BakeRequest& request) const {
  check_request(find_map(kind_), request);
  const std::vector<Bytes> inputs = find_row(kind_).make_inputs(request);
  const Heightfield& heights = request.heights;
  std::vector<double> keys(heights.texels.size());
  const Bytes output = backend_.compute({.pipeline = pipeline_.get(),
                                         .inputs = {inputs.begin(), inputs.end()},
                                         .output_bytes = std::span(keys).size_bytes(),
                                         .groups_x = groups(heights.width),
                                         .groups_y = groups(heights.height)});
  std::memcpy(keys.data(), output.data(), output.size());

  const ConeMetric metric = cone_metric(heights.width, heights.height, request.correction);
  std::vector<float> ratios(keys.size());
  std::ranges::transform(keys, ratios.begin(), [&](double key) { return ratio_of_key(key, metric); });
  if (request.correction == Correction::none) return ratios;
  return min3x3(ratios, heights.width, heights.height, request.wrap);
}

}  // namespace reliefbench
