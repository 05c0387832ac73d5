#include "kernels/maps/map_verify.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "kernels/base/error.h"
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

StoredCones stored_cones(const VerifyRequest& request, int channel) {
  if (request.map.is_solid) return solid_cones(request, channel);
  return {request.textures, request.format, request.encoding, request.wrap, request.correction == Correction::min4,
          channel};
}

MapVerdict verify_relaxed(const VerifyRequest& request) {
  const StoredCones cones = stored_cones(request, 0);
  std::optional<StoredCones> radii;
  if (request.map.kind == MapKind::safety_shape) radii = stored_cones(request, 1);
  const TexelVerdict texels = verify_relaxed_texels(cones, request.threads);
  return {.texels = static_cast<std::int64_t>(cones.heights().texels.size()),
          .texels_too_wide = texels.too_wide,
          .worst_texel = texels.worst,
          .rays = verify_rays(cones, radii ? &*radii : nullptr, request.rays, request.threads)};
}

void add(CellVerdict& sum, const CellVerdict& cells) {
  sum.cells += cells.cells;
  sum.proved += cells.proved;
  sum.broken += cells.broken;
  sum.undecided += cells.undecided;
  sum.finest = std::max(sum.finest, cells.finest);
  keep_worse(sum.worst, cells.worst);
}

MapVerdict verify_conservative(const VerifyRequest& request) {
  MapVerdict verdict;
  TexelVerdict texels;
  const bool is_quad = request.map.kind == MapKind::quad;
  for (int channel = 0; channel < request.map.ratios; ++channel) {
    const StoredCones cones = stored_cones(request, channel);
    ConservativeCones part{.cones = cones, .axis = {}, .threads = request.threads};
    if (is_quad) part.axis = kQuadAxes.at(static_cast<std::size_t>(channel));
    verdict.texels += static_cast<std::int64_t>(cones.heights().texels.size());
    texels.add(verify_conservative_texels(part));
    add(verdict.cells, verify_cells(part, request.finest));
  }
  verdict.texels_too_wide = texels.too_wide;
  verdict.worst_texel = texels.worst;
  return verdict;
}

}  // namespace

MapVerdict verify_map(const VerifyRequest& request) {
  const MapRow& map = request.map;
  if (map.content == MapContent::table) {
    const TableVerdict table = verify_omni(request);
    return {.table = table, .broken = table.wrong > 0};
  }
  if (map.content != MapContent::ratios) fail_input("a {} map has no cones to verify", map.id);
  MapVerdict verdict = map.is_relaxed ? verify_relaxed(request) : verify_conservative(request);
  if (map.promise == MapPromise::none) return verdict;
  verdict.broken = verdict.texels_too_wide > 0 || verdict.cells.broken > 0 || verdict.rays.crossing_twice > 0;
  verdict.undecided = !verdict.broken && verdict.cells.undecided > 0;
  return verdict;
}

}  // namespace reliefbench
