#include "backends/gpu_bake.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <deque>
#include <optional>
#include <utility>

#include "backends/gpu_bake_buffer.h"
#include "backends/gpu_bake_wedge.h"
#include "kernels/base/error.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/sector_map.h"

namespace reliefbench {
namespace {

/// Fewer texels than this never take a device so long that its watchdog barks, but where every pair is looked at.
constexpr std::size_t kShortTexels = std::size_t{512} * 512;

constexpr std::string_view kWedgeShader = "bake_wedge";
constexpr BakeSearch kConservativeBake{.shader = "bake_exact"};
constexpr BakeSearch kRelaxedBake{.shader = "bake_exact", .quadrants = true};

struct Row {
  MapKind kind{};
  BakeSearch search;
  std::optional<BakeSearch> other{};  ///< the map is the mean of the two
  bool needs_doubles = false;
  bool is_interleaved = false;  ///< the ratios of a texel lie together, not those of a wedge
  bool has_radii = false;       ///< a texel's ratio and, behind it, its radius
};
constexpr std::array kRows{
    Row{.kind = MapKind::conservative, .search = kConservativeBake},
    Row{.kind = MapKind::relaxed, .search = kRelaxedBake},
    Row{.kind = MapKind::relaxed_po07,
        .search = {.shader = "bake_relaxed_po07", .group_a_texel = true},
        .needs_doubles = true},
    Row{.kind = MapKind::quick_naive, .search = {.shader = "bake_quick", .footpoint = BakeFootpoint::nearest}},
    Row{.kind = MapKind::quick, .search = {.shader = "bake_quick", .footpoint = BakeFootpoint::unvisited}},
    Row{.kind = MapKind::quick_centre, .search = {.shader = "bake_quick", .footpoint = BakeFootpoint::centre}},
    Row{.kind = MapKind::hybrid, .search = kConservativeBake, .other = kRelaxedBake, .needs_doubles = true},
    Row{.kind = MapKind::safety_shape, .search = kRelaxedBake, .needs_doubles = true, .has_radii = true},
    Row{.kind = MapKind::quad, .search = {.shader = kWedgeShader, .wedges = quad_wedges}, .is_interleaved = true},
    Row{.kind = MapKind::sector, .search = {.shader = kWedgeShader, .wedges = sector_wedges}},
    Row{.kind = MapKind::sector_relaxed,
        .search = {.shader = kWedgeShader, .quadrants = true, .wedges = relaxed_sector_wedges}},
};
constexpr std::string_view kPyramidShader = "bake_pyramid";
constexpr std::string_view kMeanShader = "bake_mean";
constexpr std::string_view kMinimumShader = "bake_min3x3";
constexpr std::string_view kShapesShader = "bake_shapes";
constexpr std::string_view kRadiusShader = "bake_radius";
constexpr std::string_view kSafetyShapeShader = "bake_safety_shape";

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

/// Storage buffers of each shader.
int buffers_of(std::string_view shader) {
  if (shader == kMinimumShader) return 3;
  return shader == kWedgeShader ? 5 : 4;
}

/// The passes of a bake as they are added, and the buffers between them.
class BakePasses {
 public:
  using Pipelines = std::map<std::string, std::unique_ptr<Pipeline>>;

  BakePasses(const Pipelines& pipelines, const BakeRequest& request, bool sees_pairs)
      : pipelines_(pipelines),
        request_(request),
        levels_(quad_levels(request.heights)),
        may_be_long_(sees_pairs || request.heights.texels.size() > kShortTexels),
        heights_(add_buffer(std::as_bytes(std::span(request.heights.texels)))) {}

  // Each returns the buffer of the ratios that it makes.

  int add_search(const BakeSearch& search) {
    const std::vector<MarginedWedge> margined =
        search.wedges == nullptr ? std::vector<MarginedWedge>() : search.wedges(request_);
    layers_ = std::max(static_cast<int>(margined.size()), 1);
    const int bake = add_head(search_buffer(request_, search, levels_, layers_));
    const int pyramids = search.quadrants ? 4 : 1;
    const int quads =
        add_buffer(static_cast<std::size_t>(pyramids) * static_cast<std::size_t>(levels_.nodes) * kQuadBytes);
    const int ratios = add_ratios();
    for (int level = 1; level <= static_cast<int>(levels_.levels.size()); ++level)
      job_.passes.push_back({.part = "pyramid",
                             .pipeline = pipeline(kPyramidShader),
                             .buffers = {bake, heights_, quads, ratios},
                             .groups_x = groups(nodes_at(request_.heights.width, level)),
                             .groups_y = groups(nodes_at(request_.heights.height, level)),
                             .groups_z = pyramids,
                             .argument = level});
    std::vector<int> buffers{bake, heights_, quads, ratios};
    if (!margined.empty()) buffers.push_back(add_wedges(margined));
    add_pass("search", search.shader, std::move(buffers));
    ComputePass& pass = job_.passes.back();
    pass.may_be_long =
        may_be_long_ || request_.heights.texels.size() * static_cast<std::size_t>(layers_) > kShortTexels;
    if (search.group_a_texel) {
      pass.groups_x = request_.heights.width;
      pass.groups_y = request_.heights.height;
    }
    return ratios;
  }

  int add_mean(int first, int second) {
    const int means = add_ratios();
    add_pass("correction", kMeanShader, {head_, first, second, means});
    return means;
  }

  int add_minimum(int ratios) {
    const int least = add_ratios();
    add_pass("correction", kMinimumShader, {head_, ratios, least});
    return least;
  }

  /// Radii, as their own minimum leaves them.
  int add_radii() {
    const BakeLevels levels = shape_levels(request_.heights, request_.wrap);
    const int bake = add_head(radius_buffer(request_, levels));
    const int shapes = add_buffer(static_cast<std::size_t>(levels.nodes) * kShapeBytes);
    const int radii = add_ratios();
    const std::vector<int> buffers{bake, heights_, shapes, radii};
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
    add_pass("search", kRadiusShader, buffers);
    job_.passes.back().may_be_long = may_be_long_;
    return request_.correction == Correction::none ? radii : add_minimum(radii);
  }

  int add_safety_shape(int ratios, int radii) {
    const int both = add_buffer(2 * std::span(request_.heights.texels).size_bytes());
    add_pass("pack", kSafetyShapeShader, {head_, ratios, radii, both});
    return both;
  }

  /// The whole, for what is in one of its buffers. The passes' contents live as long as this.
  [[nodiscard]] ComputeJob job(int result) const {
    ComputeJob whole = job_;
    whole.result = result;
    return whole;
  }

 private:
  int add_buffer(std::size_t bytes) {
    job_.buffers.push_back({.bytes = bytes});
    return static_cast<int>(job_.buffers.size()) - 1;
  }
  int add_buffer(std::span<const std::byte> contents) {
    const int place = add_buffer(contents.size());
    job_.buffers.back().contents = contents;
    return place;
  }
  int add_ratios() {
    return add_buffer(static_cast<std::size_t>(layers_) * std::span(request_.heights.texels).size_bytes());
  }
  int add_head(std::vector<std::byte> bytes) {
    contents_.push_back(std::move(bytes));
    head_ = add_buffer(contents_.back());
    return head_;
  }
  int add_wedges(const std::vector<MarginedWedge>& margined) {
    const std::vector<BakeWedge> wedges = bake_wedges(margined, request_);
    const auto bytes = std::as_bytes(std::span(wedges));
    contents_.emplace_back(bytes.begin(), bytes.end());
    return add_buffer(contents_.back());
  }
  void add_pass(std::string_view part, std::string_view shader, std::vector<int> buffers) {
    job_.passes.push_back({.part = part,
                           .pipeline = pipeline(shader),
                           .buffers = std::move(buffers),
                           .groups_x = groups(request_.heights.width),
                           .groups_y = groups(request_.heights.height),
                           .groups_z = layers_});
  }
  [[nodiscard]] const Pipeline* pipeline(std::string_view shader) const {
    return pipelines_.at(std::string(shader)).get();
  }

  const Pipelines& pipelines_;
  const BakeRequest& request_;
  BakeLevels levels_;
  bool may_be_long_;
  ComputeJob job_;
  std::deque<std::vector<std::byte>> contents_;  ///< of the searches' buffers
  int layers_ = 1;
  int heights_;
  int head_ = 0;  ///< any search's: all know the map's size, wrap and correction
};

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

std::map<std::string, Spirv> compile_baker(MapKind kind, Dialect dialect, BakeNumbers numbers) {
  const Row& row = find_row(kind);
  if (row.needs_doubles && numbers == BakeNumbers::floats)
    fail_environment("{}: its GPU baker needs double precision in shaders", find_map(kind).id);
  std::vector<std::string_view> names{kPyramidShader, row.search.shader, kMinimumShader};
  if (row.other) names.insert(names.end(), {row.other->shader, kMeanShader});
  if (row.has_radii) names.insert(names.end(), {kShapesShader, kRadiusShader, kSafetyShapeShader});
  std::map<std::string, Spirv> shaders;
  for (const std::string_view name : names)
    shaders.emplace(name,
                    compile_compute(name, dialect, {.name = "bake_contract.glsl", .text = bake_contract(numbers)}));
  return shaders;
}

GpuBaker::GpuBaker(Backend& backend, Dialect dialect, MapKind kind)
    : GpuBaker(backend, dialect, kind, backend.device().float64 ? BakeNumbers::doubles : BakeNumbers::floats) {}

GpuBaker::GpuBaker(Backend& backend, Dialect dialect, MapKind kind, BakeNumbers numbers)
    : backend_(backend), kind_(kind) {
  for (const auto& [name, spirv] : compile_baker(kind, dialect, numbers))
    pipelines_.emplace(name, backend.compile_compute({.label = name, .spirv = spirv, .buffers = buffers_of(name)}));
}

std::span<const Correction> gpu_corrections() { return kCorrections; }

GpuBake GpuBaker::bake(const BakeRequest& request) const {
  check_request(request, kind_);
  check_correction(request.correction);
  const Row& row = find_row(kind_);
  // A mean's two maps are as they are, and its minimum comes last.
  BakeRequest searched = request;
  if (row.other) searched.correction = Correction::none;
  BakePasses passes(pipelines_, searched, find_map(kind_).sees_pairs);
  int ratios = passes.add_search(row.search);
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
  if (std::ranges::find(bake.values, kCutShort) != bake.values.end())
    fail_environment("{} ends a shader's loops before the search of this {} map is done; the CPU bakes it",
                     backend_.device().name, find_map(kind_).id);
  return bake;
}

}  // namespace reliefbench
