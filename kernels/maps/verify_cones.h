#pragma once
#include <cstdint>
#include <optional>

#include "kernels/maps/cone_search.h"
#include "kernels/maps/map_verify.h"
#include "kernels/maps/stored_cones.h"

namespace reliefbench {

// The parts of verify_map().

/// A witness's ratio may be off by this factor: double arithmetic, and h_tan's division by a small depth.
inline constexpr double kWitnessGuard = 1 - 0x1p-20;

struct TexelVerdict {
  std::int64_t too_wide = 0;
  WorstCone worst{};
  /// The wider of two violations, the earlier where they are equal.
  void add(const TexelVerdict& other);
};
void keep_worse(WorstCone& worst, const WorstCone& other);

/// Conservative cones, or the sectors of such cones round an axis.
struct ConservativeCones {
  const StoredCones& cones;
  std::optional<ConeView::Normal> axis{};
  int threads = 0;
};
/// Texels whose open cone holds another texel's surface point.
[[nodiscard]] TexelVerdict verify_conservative_texels(const ConservativeCones& request);
[[nodiscard]] CellVerdict verify_cells(const ConservativeCones& request, int finest);

/// Texels whose open cone holds a texel's surface point that descends away from the apex.
[[nodiscard]] TexelVerdict verify_relaxed_texels(const StoredCones& cones, int threads);
/// radii: of cylinders that the cones are united with (safety_shape), or null
[[nodiscard]] RayVerdict verify_rays(const StoredCones& cones, const StoredCones* radii, int rays, int threads);

}  // namespace reliefbench
