#include "backends/gpu_bake.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "kernels/base/error.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"
#include "kernels/maps/max_pyramid.h"

namespace reliefbench {
namespace {

constexpr int kGroupSide = 8;  // texels

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
  std::int32_t footpoint = 0;
  std::int32_t padding = 0;
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
          .search_steps = request.value(kSearchSteps),
          .repeats = request.wrap == Wrap::repeat ? 1 : 0};
}

template <typename T>
void append(Bytes& bytes, std::span<const T> values) {
  const std::size_t end = bytes.size();
  bytes.resize(end + values.size_bytes());
  std::memcpy(bytes.data() + end, values.data(), values.size_bytes());
}

/// Appends the nodes of all levels, level 0 first; returns where each level begins in the pyramid.
std::vector<BakeLevel> append(Bytes& nodes, const MaxPyramid& pyramid) {
  std::vector<BakeLevel> levels;
  std::size_t node = 0;
  for (const MaxPyramid::Level& level : pyramid.levels()) {
    levels.push_back(
        {.first_node = static_cast<std::int32_t>(node), .stride = static_cast<std::int32_t>(level.stride)});
    node += level.nodes.size();
    append<float>(nodes, level.nodes);
  }
  return levels;
}

/// Which texel of a node the quick bakers measure the distance to.
enum Footpoint : std::int32_t { kNearest, kUnvisited, kCentre };

/// What the shaders share with this file, as GLSL: bake_contract.glsl.
std::string bake_contract() {
  std::string text;
  const auto add = [&](std::string_view name, int value) { text += fmt::format("#define {} {}\n", name, value); };
  add("GROUP_SIDE", kGroupSide);
  add("OUTPUT_BINDING", kOutputBinding);
  add("BAND_BINDING", kBandBinding);
  add("FIRST_INPUT_BINDING", kFirstInputBinding);
  add("FOOTPOINT_NEAREST", kNearest);      // the nearest one
  add("FOOTPOINT_UNVISITED", kUnvisited);  // the nearest one that no finer level has visited
  add("FOOTPOINT_CENTRE", kCentre);
  return text;
}

struct Row {
  MapKind kind;
  std::string_view shader;  ///< name of the .comp file
  bool quadrants = false;   ///< bake_exact.comp: one pyramid each
  Footpoint footpoint = kNearest;
};
constexpr std::array kRows{
    Row{.kind = MapKind::conservative, .shader = "bake_exact"},
    Row{.kind = MapKind::relaxed, .shader = "bake_exact", .quadrants = true},
    Row{.kind = MapKind::relaxed_po07, .shader = "bake_relaxed_po07"},
    Row{.kind = MapKind::quick_naive, .shader = "bake_quick", .footpoint = kNearest},
    Row{.kind = MapKind::quick, .shader = "bake_quick", .footpoint = kUnvisited},
    Row{.kind = MapKind::quick_centre, .shader = "bake_quick", .footpoint = kCentre},
};

struct Inputs {
  Bytes bake;
  Bytes nodes;
};

/// The pyramid of all texels; or one a quadrant, of the texels that bound a relaxed cone in it, then the map's heights.
Inputs make_inputs(const Row& row, const BakeRequest& request) {
  Inputs inputs;
  BakeHead head = head_of(request);
  head.footpoint = row.footpoint;
  if (row.quadrants) {
    for (const int y : {1, -1})
      for (const int x : {1, -1})
        append(inputs.nodes, MaxPyramid(limiting_heights(request.heights, request.wrap, x, y)));
    head.pyramids = 4;
    head.heights = static_cast<std::int32_t>(inputs.nodes.size() / sizeof(float));
    head.pyramid_nodes = head.heights / head.pyramids;
  }
  const std::vector<BakeLevel> levels = append(inputs.nodes, MaxPyramid(request.heights));
  head.root = static_cast<std::int32_t>(levels.size()) - 1;
  append<BakeHead>(inputs.bake, {&head, 1});
  append<BakeLevel>(inputs.bake, levels);
  return inputs;
}

constexpr std::array kCorrections{Correction::none, Correction::min3x3, Correction::safe, Correction::min4};

const Row& find_row(MapKind kind) {
  const auto* row = std::ranges::find(kRows, kind, &Row::kind);
  if (row == kRows.end()) fail_input("{}: no GPU baker", find_map(kind).id);
  return *row;
}

void check_correction(Correction correction) {
  if (std::ranges::find(kCorrections, correction) == kCorrections.end())
    fail_input("no GPU baker makes the correction `{}`; the CPU's does", correction_id(correction));
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

Spirv compile_baker(MapKind kind, Dialect dialect) {
  return compile_compute(find_row(kind).shader, dialect, {.name = "bake_contract.glsl", .text = bake_contract()});
}

GpuBaker::GpuBaker(Backend& backend, Dialect dialect, MapKind kind) : backend_(backend), kind_(kind) {
  const DeviceInfo& device = backend.device();
  if (!device.float64) fail_environment("{}: no double precision in shaders, which a bake needs", device.name);
  const Spirv spirv = compile_baker(kind, dialect);
  pipeline_ = backend.compile_compute({.label = std::string(find_map(kind).id), .spirv = spirv, .inputs = 2});
}

std::span<const Correction> gpu_corrections() { return kCorrections; }

std::vector<float> GpuBaker::bake(const BakeRequest& request) const {
  check_request(request, kind_);
  check_correction(request.correction);
  const Inputs inputs = make_inputs(find_row(kind_), request);
  const Heightfield& heights = request.heights;
  std::vector<double> keys(heights.texels.size());
  const Bytes output = backend_.compute({.pipeline = pipeline_.get(),
                                         .inputs = {inputs.bake, inputs.nodes},
                                         .output_bytes = std::span(keys).size_bytes(),
                                         .groups_x = groups(heights.width),
                                         .groups_y = groups(heights.height)});
  std::memcpy(keys.data(), output.data(), output.size());

  const ConeMetric metric = cone_metric(heights.width, heights.height, request.correction);
  std::vector<float> ratios(keys.size());
  std::ranges::transform(keys, ratios.begin(), [&](double key) { return ratio_of_key(key, metric); });
  if (request.correction != Correction::min3x3 && request.correction != Correction::safe) return ratios;
  return min3x3(ratios, heights.width, heights.height, request.wrap);
}

}  // namespace reliefbench
