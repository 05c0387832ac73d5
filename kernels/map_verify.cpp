#include "kernels/map_verify.h"

#include "kernels/error.h"
#include "kernels/verify_cones.h"

namespace reliefbench {
namespace {

/// Whether every point between the texels is promised, not texel centres alone.
bool promises_all_points(const VerifyRequest& request) { return request.correction != Correction::none; }

}  // namespace

MapVerdict verify_map(const VerifyRequest& request) {
  const MapRow& map = request.map;
  if (map.content != MapContent::ratios) fail_input("a {} map has no cones to verify", map.id);
  const StoredCones cones(request.textures, request.format, request.encoding, request.wrap,
                          request.correction == Correction::min4);
  MapVerdict verdict{.texels = static_cast<std::int64_t>(cones.heights().texels.size())};
  TexelVerdict texels;
  if (map.is_relaxed) {
    texels = verify_relaxed_texels(cones, request.threads);
    verdict.rays = verify_rays(cones, request.rays, request.threads);
  } else {
    texels = verify_conservative_texels(cones, request.threads);
    verdict.cells = verify_cells(cones, request.finest, request.threads);
  }
  verdict.texels_too_wide = texels.too_wide;
  verdict.worst_texel = texels.worst;
  if (map.promise == MapPromise::none) return verdict;
  const bool is_broken_inside = verdict.cells.broken > 0 || verdict.rays.crossing_twice > 0;
  verdict.broken = texels.too_wide > 0 || (promises_all_points(request) && is_broken_inside);
  verdict.undecided = !verdict.broken && promises_all_points(request) && verdict.cells.undecided > 0;
  return verdict;
}

}  // namespace reliefbench
