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
#include "kernels/maps/solid_map.h"

namespace reliefbench {
namespace {

constexpr BakeSearch kConservativeBake{.shader = "bake_exact", .unit = BakeUnit::packets};
constexpr BakeSearch kRelaxedBake{.shader = "bake_quadrants", .quadrants = true, .unit = BakeUnit::packets};

struct Row {
  MapKind kind{};
  BakeSearch search{};
  std::optional<BakeSearch> on_software{};  ///< instead of `search`
  std::optional<BakeSearch> other{};        ///< the map is the mean of the two
  bool needs_doubles = false;
  int layers = 1;          ///< whose values of a texel, or node, lie together in the map
  bool has_radii = false;  ///< a texel's ratio and, behind it, its radius
  bool has_cells = false;  ///< cones are those of cells
  bool is_double_cone = false;
  bool is_chain = false;           ///< no cones: a mip chain
  bool is_chain_of_cells = false;  ///< instead of texels
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
    Row{.kind = MapKind::quick_published, .search = {.shader = "bake_quick", .footpoint = BakeFootpoint::published}},
    Row{.kind = MapKind::quick_centre, .search = {.shader = "bake_quick", .footpoint = BakeFootpoint::centre}},
    Row{.kind = MapKind::hybrid, .search = kConservativeBake, .other = kRelaxedBake},
    Row{.kind = MapKind::safety_shape, .search = kRelaxedBake, .needs_doubles = true, .has_radii = true},
    Row{.kind = MapKind::quad,
        .search = {.shader = kWedgeShader, .unit = BakeUnit::packets, .wedges = quad_wedges},
        .layers = 4},
    Row{.kind = MapKind::sector,
        .search = {.shader = kWedgeShader, .unit = BakeUnit::packets, .wedges = sector_wedges}},
    Row{.kind = MapKind::sector_relaxed,
        .search =
            {.shader = kWedgeShader, .quadrants = true, .unit = BakeUnit::packets, .wedges = relaxed_sector_wedges}},
    Row{.kind = MapKind::cell, .search = {.shader = kWedgeShader, .unit = BakeUnit::packets}, .has_cells = true},
    Row{.kind = MapKind::double_cone, .search = kConservativeBake, .needs_doubles = true, .is_double_cone = true},
    Row{.kind = MapKind::max_mip, .is_chain = true, .is_chain_of_cells = true},
    Row{.kind = MapKind::quadtree, .is_chain = true},
    Row{.kind = MapKind::double_mip, .layers = 2, .is_chain = true, .is_chain_of_cells = true},
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

/// How add_values() leaves a map's values.
ValueLayout layout_of(const Row& row, const Heightfield& heights) {
  if (row.has_radii || row.is_double_cone) return {.texel_stride = 2, .ratio_stride = 1};
  const int nodes = chain_levels(heights.width, heights.height).nodes;
  return {.ratio_stride = row.is_chain ? nodes : heights.width * heights.height};
}

/// So many layers as the values of each layer's first, then of each one's second, ...
std::vector<float> interleaved(const std::vector<float>& layers, std::size_t count) {
  const std::size_t size = layers.size() / count;
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

bool can_pack(const Format& format, BakeDevice device) { return device.has_doubles && !is_of_blocks(format.type); }

std::map<std::string, Spirv> compile_baker(MapKind kind, Dialect dialect, BakeDevice device,
                                           const std::optional<BakePacking>& packing) {
  const Row& row = find_row(kind);
  if (row.needs_doubles && !device.has_doubles)
    fail_environment("{}: its GPU baker needs double precision in shaders", find_map(kind).id);
  const BakeSearch& search = search_of(row, device);
  std::vector<std::string_view> names;
  if (row.is_chain) names.push_back(kLevelsShader);
  if (!row.is_chain) names.insert(names.end(), {kPyramidShader, search.shader, kMinimumShader});
  if (row.is_double_cone) names.push_back(kDoubleConeShader);
  if (search.walks_rays) names.push_back(kCornersShader);
  if (row.other) names.insert(names.end(), {row.other->shader, kMeanShader});
  if (row.has_radii) names.insert(names.end(), {kShapesShader, kRadiusShader, kSafetyShapeShader});
  if (has_certified(kind)) names.insert(names.end(), {kBoundsShader, kLimitsShader, kRaiseShader});
  if (has_certified(kind) && device.has_doubles) names.push_back(kRefineShader);
  if (packing) names.push_back(kPackShader);
  const std::string contract = bake_contract(device, search.footpoint) + (packing ? pack_contract(*packing) : "");
  std::map<std::string, Spirv> shaders;
  for (const std::string_view name : names)
    shaders.emplace(name, compile_compute(name, dialect, {.name = "bake_contract.glsl", .text = contract}));
  return shaders;
}

GpuBaker::GpuBaker(Backend& backend, Dialect dialect, MapKind kind, const std::optional<BakePacking>& packing)
    : GpuBaker(backend, dialect, kind,
               {.has_doubles = backend.device().float64, .is_software = backend.device().software}, packing) {}

GpuBaker::GpuBaker(Backend& backend, Dialect dialect, MapKind kind, BakeDevice device,
                   const std::optional<BakePacking>& packing)
    : backend_(backend), kind_(kind), device_(device) {
  if (packing && can_pack(packing->format, device)) packing_.emplace(*packing);
  for (const auto& [name, spirv] : compile_baker(kind, dialect, device, packing_))
    pipelines_.emplace(name, backend.compile_compute({.label = name, .spirv = spirv, .buffers = buffers_of(name)}));
}

GpuBake GpuBaker::bake(const BakeRequest& request) const {
  constexpr int kMuchPatience = 16;
  check_request(request, kind_);
  if (find_map(kind_).is_solid) check_solid(request.heights);
  std::optional<GpuBake> bake = bake_once(request, 1);
  if (!bake && search_of(find_row(kind_), device_).goes_on) bake = bake_once(request, kMuchPatience);
  if (!bake)
    fail_environment("{} ends a shader's loops before the search of this {} map is done; the CPU bakes it",
                     backend_.device().name, find_map(kind_).id);
  return std::move(*bake);
}

int GpuBaker::add_values(BakePasses& passes, Correction correction) const {
  const Row& row = find_row(kind_);
  const BakeSearch& search = search_of(row, device_);
  if (row.is_chain) return passes.add_chain(row.is_chain_of_cells);
  if (row.is_double_cone) return passes.add_double_cone(search);
  if (row.has_cells) return passes.add_cells(search);
  if (correction == Correction::certified) return passes.add_certified(search);
  if (row.other) {
    const int one = passes.add_search(search);
    const int mean = passes.add_mean(one, passes.add_search(*row.other));
    return correction == Correction::none ? mean : passes.add_minimum(mean);
  }
  const int ratios = passes.add_corrected(passes.add_search(search));
  return row.has_radii ? passes.add_safety_shape(ratios, passes.add_radii()) : ratios;
}

std::optional<GpuBake> GpuBaker::bake_once(const BakeRequest& request, int patience) const {
  const Row& row = find_row(kind_);
  const bool is_certified = request.correction == Correction::certified;
  BakeRequest searched = request;
  if (row.other) searched.correction = Correction::none;  // the mean's minimum comes last
  if (is_certified) searched.correction = Correction::safe;
  BakePasses passes(pipelines_, searched,
                    {.device = device_, .sees_pairs = find_map(kind_).sees_pairs, .patience = patience});
  const int values = add_values(passes, request.correction);
  if (!packing_) {
    const ComputeResult computed = backend_.compute(passes.job(values));
    GpuBake bake{.values = std::vector<float>(computed.bytes.size() / sizeof(float)),
                 .times = computed.times,
                 .transport_ns = computed.transport_ns};
    std::memcpy(bake.values.data(), computed.bytes.data(), computed.bytes.size());
    if (std::ranges::find(bake.values, kCutShort) != bake.values.end()) return std::nullopt;
    if (row.layers > 1) bake.values = interleaved(bake.values, static_cast<std::size_t>(row.layers));
    return bake;
  }
  const MapSource source{.map = find_map(kind_),
                         .heights = request.heights,
                         .values = {},
                         .wrap = request.wrap,
                         .relief_depth = packing_->relief_depth,
                         .parameters = request.parameters};
  MapTextures textures = blank_textures(source, packing_->format);
  const PackPlan plan = pack_plan(source, packing_->format, textures, layout_of(row, request.heights));
  const ComputeResult computed = backend_.compute(passes.job(passes.add_packed(values, plan)));
  if (was_cut_short(plan, computed.bytes)) return std::nullopt;
  fill_textures(textures, plan, computed.bytes);
  return GpuBake{
      .values = {}, .textures = std::move(textures), .times = computed.times, .transport_ns = computed.transport_ns};
}

}  // namespace reliefbench
