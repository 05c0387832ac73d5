#include "backends/gpu_bake.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <utility>

#include "backends/gpu_bake_passes.h"
#include "kernels/base/error.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/sector_map.h"

namespace reliefbench {
namespace {

constexpr BakeSearch kConservativeBake{.shader = "bake_exact", .unit = BakeUnit::packets};
constexpr BakeSearch kRelaxedBake{.shader = "bake_quadrants", .quadrants = true, .unit = BakeUnit::packets};

struct Row {
  MapKind kind{};
  BakeSearch search;
  std::optional<BakeSearch> on_software{};  ///< instead of `search`
  std::optional<BakeSearch> other{};        ///< the map is the mean of the two
  bool needs_doubles = false;
  bool is_interleaved = false;  ///< the ratios of a texel lie together, not those of a wedge
  bool has_radii = false;       ///< a texel's ratio and, behind it, its radius
  bool has_cells = false;       ///< cones are those of cells
};
constexpr std::array kRows{
    Row{.kind = MapKind::conservative, .search = kConservativeBake},
    Row{.kind = MapKind::relaxed, .search = kRelaxedBake},
    Row{.kind = MapKind::relaxed_po07,
        .search = {.shader = kWalkShader, .unit = BakeUnit::groups, .walks_rays = true},
        .on_software =
            BakeSearch{.shader = kWalkPacketsShader, .unit = BakeUnit::packets, .walks_rays = true, .goes_on = true},
        .needs_doubles = true},
    Row{.kind = MapKind::quick_naive, .search = {.shader = "bake_quick", .footpoint = BakeFootpoint::nearest}},
    Row{.kind = MapKind::quick, .search = {.shader = "bake_quick", .footpoint = BakeFootpoint::unvisited}},
    Row{.kind = MapKind::quick_centre, .search = {.shader = "bake_quick", .footpoint = BakeFootpoint::centre}},
    Row{.kind = MapKind::hybrid, .search = kConservativeBake, .other = kRelaxedBake},
    Row{.kind = MapKind::safety_shape, .search = kRelaxedBake, .needs_doubles = true, .has_radii = true},
    Row{.kind = MapKind::quad,
        .search = {.shader = kWedgeShader, .unit = BakeUnit::packets, .wedges = quad_wedges},
        .is_interleaved = true},
    Row{.kind = MapKind::sector,
        .search = {.shader = kWedgeShader, .unit = BakeUnit::packets, .wedges = sector_wedges}},
    Row{.kind = MapKind::sector_relaxed,
        .search =
            {.shader = kWedgeShader, .quadrants = true, .unit = BakeUnit::packets, .wedges = relaxed_sector_wedges}},
    Row{.kind = MapKind::cell, .search = {.shader = kWedgeShader, .unit = BakeUnit::packets}, .has_cells = true},
};

const Row& find_row(MapKind kind) {
  const auto* row = std::ranges::find(kRows, kind, &Row::kind);
  if (row == kRows.end()) fail_input("{}: no GPU baker", find_map(kind).id);
  return *row;
}

const BakeSearch& search_of(const Row& row, BakeDevice device) {
  return device.is_software && row.on_software ? *row.on_software : row.search;
}

bool has_certified(MapKind kind) { return std::ranges::count(find_map(kind).corrections, Correction::certified) > 0; }

/// Layers of so many values as the values of each layer's first, then of each one's second, ...
std::vector<float> interleaved(const std::vector<float>& layers, std::size_t size) {
  const std::size_t count = layers.size() / size;
  std::vector<float> mixed(layers.size());
  for (std::size_t k = 0; k < count; ++k)
    for (std::size_t i = 0; i < size; ++i) mixed[count * i + k] = layers[size * k + i];
  return mixed;
}

}  // namespace

std::span<const MapKind> gpu_bakers() {
  static const auto kinds = [] {
    std::array<MapKind, kRows.size()> list{};
    std::ranges::transform(kRows, list.begin(), &Row::kind);
    return list;
  }();
  return kinds;
}

bool has_gpu_baker(MapKind kind) { return std::ranges::find(gpu_bakers(), kind) != gpu_bakers().end(); }

std::map<std::string, Spirv> compile_baker(MapKind kind, Dialect dialect, BakeDevice device) {
  const Row& row = find_row(kind);
  if (row.needs_doubles && !device.has_doubles)
    fail_environment("{}: its GPU baker needs double precision in shaders", find_map(kind).id);
  const BakeSearch& search = search_of(row, device);
  std::vector<std::string_view> names{kPyramidShader, search.shader, kMinimumShader};
  if (search.walks_rays) names.push_back(kCornersShader);
  if (row.other) names.insert(names.end(), {row.other->shader, kMeanShader});
  if (row.has_radii) names.insert(names.end(), {kShapesShader, kRadiusShader, kSafetyShapeShader});
  if (has_certified(kind)) names.insert(names.end(), {kBoundsShader, kLimitsShader, kRaiseShader});
  if (has_certified(kind) && device.has_doubles) names.push_back(kRefineShader);
  std::map<std::string, Spirv> shaders;
  for (const std::string_view name : names)
    shaders.emplace(name,
                    compile_compute(name, dialect, {.name = "bake_contract.glsl", .text = bake_contract(device)}));
  return shaders;
}

GpuBaker::GpuBaker(Backend& backend, Dialect dialect, MapKind kind)
    : GpuBaker(backend, dialect, kind,
               {.has_doubles = backend.device().float64, .is_software = backend.device().software}) {}

GpuBaker::GpuBaker(Backend& backend, Dialect dialect, MapKind kind, BakeDevice device)
    : backend_(backend), kind_(kind), device_(device) {
  for (const auto& [name, spirv] : compile_baker(kind, dialect, device))
    pipelines_.emplace(name, backend.compile_compute({.label = name, .spirv = spirv, .buffers = buffers_of(name)}));
}

GpuBake GpuBaker::bake(const BakeRequest& request) const {
  constexpr int kMuchPatience = 16;
  check_request(request, kind_);
  const auto is_cut_short = [](const GpuBake& bake) {
    return std::ranges::find(bake.values, kCutShort) != bake.values.end();
  };
  GpuBake bake = bake_once(request, 1);
  if (is_cut_short(bake) && search_of(find_row(kind_), device_).goes_on) bake = bake_once(request, kMuchPatience);
  if (is_cut_short(bake))
    fail_environment("{} ends a shader's loops before the search of this {} map is done; the CPU bakes it",
                     backend_.device().name, find_map(kind_).id);
  return bake;
}

GpuBake GpuBaker::bake_once(const BakeRequest& request, int patience) const {
  const Row& row = find_row(kind_);
  const bool is_certified = request.correction == Correction::certified;
  BakeRequest searched = request;
  if (row.other) searched.correction = Correction::none;  // the mean's minimum comes last
  if (is_certified) searched.correction = Correction::safe;
  BakePasses passes(pipelines_, searched,
                    {.device = device_, .sees_pairs = find_map(kind_).sees_pairs, .patience = patience});
  const BakeSearch& search = search_of(row, device_);
  int ratios = row.has_cells  ? passes.add_cells(search)
               : is_certified ? passes.add_certified(search)
                              : passes.add_search(search);
  if (row.other) ratios = passes.add_mean(ratios, passes.add_search(*row.other));
  if (request.correction == Correction::min3x3 || request.correction == Correction::safe)
    ratios = passes.add_minimum(ratios);
  if (row.has_radii) ratios = passes.add_safety_shape(ratios, passes.add_radii());
  const ComputeResult computed = backend_.compute(passes.job(ratios));
  GpuBake bake{.values = std::vector<float>(computed.bytes.size() / sizeof(float)),
               .times = computed.times,
               .transport_ns = computed.transport_ns};
  std::memcpy(bake.values.data(), computed.bytes.data(), computed.bytes.size());
  if (row.is_interleaved) bake.values = interleaved(bake.values, request.heights.texels.size());
  return bake;
}

}  // namespace reliefbench
