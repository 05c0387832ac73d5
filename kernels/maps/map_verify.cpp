#include "kernels/maps/map_verify.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/maps/sector_map.h"
#include "kernels/maps/solid_map.h"
#include "kernels/maps/verify_cones.h"

namespace reliefbench {
namespace {

/// Of a solid: the upward cones, or the downward ones, everything mirrored.
StoredCones solid_cones(const VerifyRequest& request, int channel) {
  const bool is_apart = request.format.extra_channels > 0;
  const TextureImage& image = is_apart ? request.textures.extra.value() : request.textures.relief;
  const int first = is_apart ? 0 : 1;
  Heightfield heights = unpack_map(request.textures, request.format, request.encoding, true).heights;
  if (channel == 1) heights = mirrored_floors(heights);
  heights.floors.clear();
  return {std::move(heights), read_channel(image, first + 1 + channel), request.encoding, request.wrap, false};
}

/// Cones of one kind that a map has, for all directions or for those in a wedge.
struct ConePart {
  StoredCones cones;
  std::optional<Wedge> wedge{};
};

StoredCones stored_cones(const VerifyRequest& request, const MapTextures& textures, int channel) {
  if (request.map.is_solid) return solid_cones(request, channel);
  return {textures, request.format, request.encoding, request.wrap, request.correction == Correction::min4, channel};
}

std::vector<ConePart> parts_of(const VerifyRequest& request) {
  std::vector<ConePart> parts;
  if (request.map.content == MapContent::sectors) {
    const std::vector<MapTextures> layers = cone_layers(request.map, request.textures, request.parameters);
    const auto count = static_cast<int>(layers.size());
    const int ratios = has_opposite_ratios(request.parameters) ? 2 : 1;
    for (int k = 0; k < count; ++k)
      for (int channel = 0; channel < ratios; ++channel)
        parts.push_back({.cones = stored_cones(request, layers[static_cast<std::size_t>(k)], channel),
                         .wedge = sector_wedge(k ^ (channel * kOpposite), count)});
    return parts;
  }
  const bool is_quad = request.map.kind == MapKind::quad;
  const int channels = is_quad || request.map.is_solid ? request.map.ratios : 1;
  for (int channel = 0; channel < channels; ++channel) {
    parts.push_back({.cones = stored_cones(request, request.textures, channel)});
    if (is_quad) parts.back().wedge = kQuadWedges.at(static_cast<std::size_t>(channel));
  }
  return parts;
}

void add(RayVerdict& sum, const RayVerdict& rays) {
  sum.rays += rays.rays;
  sum.crossing_twice += rays.crossing_twice;
  keep_worse(sum.worst, rays.worst);
}

void add(CellVerdict& sum, const CellVerdict& cells) {
  sum.cells += cells.cells;
  sum.proved += cells.proved;
  sum.broken += cells.broken;
  sum.undecided += cells.undecided;
  sum.finest = std::max(sum.finest, cells.finest);
  keep_worse(sum.worst, cells.worst);
}

CellVerdict verify_stored_cell_cones(const VerifyRequest& request) {
  const TextureImage& relief = request.textures.relief;
  const Heightfield heights{.width = relief.width, .height = relief.height, .texels = read_channel(relief, 0)};
  CellCones cones{.heights = heights,
                  .tops = std::vector<float>(heights.texels.size(), 1.0F),
                  .ratios = {},
                  .wrap = request.wrap,
                  .threads = request.threads};
  for (const MapTextures& layer : cone_layers(request.map, request.textures, request.parameters)) {
    const std::vector<float> tops = read_channel(layer.relief, 0);
    const std::vector<float> stored = read_channel(layer.relief, 1);
    cones.ratios.reserve(cones.ratios.size() + stored.size());
    for (std::size_t i = 0; i < tops.size(); ++i) {
      cones.tops[i] = std::min(cones.tops[i], tops[i]);
      cones.ratios.push_back(request.encoding.decode(stored[i], tops[i]));
    }
  }
  return verify_cell_cones(cones);
}

MapVerdict verify_cones(const VerifyRequest& request) {
  MapVerdict verdict;
  TexelVerdict texels;
  std::optional<StoredCones> radii;
  if (request.map.kind == MapKind::safety_shape) radii = stored_cones(request, request.textures, 1);
  for (const auto& [cones, wedge] : parts_of(request)) {
    verdict.texels += static_cast<std::int64_t>(cones.heights().texels.size());
    if (request.map.is_relaxed) {
      const RelaxedCones part{
          .cones = cones, .radii = radii ? &*radii : nullptr, .wedge = wedge, .threads = request.threads};
      texels.add(verify_relaxed_texels(part));
      add(verdict.rays, verify_rays(part, request.rays));
    } else {
      const ConservativeCones part{.cones = cones, .wedge = wedge, .threads = request.threads};
      texels.add(verify_conservative_texels(part));
      add(verdict.cells, verify_cells(part, request.finest));
    }
  }
  verdict.texels_too_wide = texels.too_wide;
  verdict.worst_texel = texels.worst;
  return verdict;
}

}  // namespace

bool can_be_verified(const MapRow& map) {
  return map.content == MapContent::ratios || map.content == MapContent::sectors || map.content == MapContent::table;
}

MapVerdict verify_map(const VerifyRequest& request) {
  const MapRow& map = request.map;
  if (!can_be_verified(map)) fail_input("a {} map has no cones to verify", map.id);
  if (map.content == MapContent::table) {
    const TableVerdict table = verify_omni(request);
    return {.table = table, .broken = table.wrong > 0};
  }
  MapVerdict verdict = map.is_of_cells ? MapVerdict{.cells = verify_stored_cell_cones(request)} : verify_cones(request);
  if (map.promise == MapPromise::none) return verdict;
  verdict.broken = verdict.texels_too_wide > 0 || verdict.cells.broken > 0 || verdict.rays.crossing_twice > 0;
  verdict.undecided = !verdict.broken && verdict.cells.undecided > 0;
  return verdict;
}

}  // namespace reliefbench
