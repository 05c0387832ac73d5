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

/// Conservative cones, or what a wedge has of such cones.
struct ConservativeCones {
  const StoredCones& cones;
  std::optional<Wedge> wedge{};
  int threads = 0;
};
/// Texels whose open cone holds another texel's surface point.
[[nodiscard]] TexelVerdict verify_conservative_texels(const ConservativeCones& request);
[[nodiscard]] CellVerdict verify_cells(const ConservativeCones& request, int finest);

/// Cones of cells, as they are stored: layer after layer.
struct CellCones {
  const Heightfield& heights;
  std::vector<float> tops;  ///< the lowest of the layers'
  std::vector<float> ratios;
  Wrap wrap = Wrap::repeat;
  int threads = 0;
};
/// Proved where they are no wider than bake_cell's theorem allows for the heights and tops as stored, broken where one
/// holds a texel's surface point, or stands on less than a corner.
[[nodiscard]] CellVerdict verify_cell_cones(const CellCones& request);

/// Whether the wedge has a direction in uv, by more than rounding.
[[nodiscard]] bool has_direction(const Wedge& wedge, double u, double v);

/// Relaxed cones, or what a wedge has of them.
struct RelaxedCones {
  const StoredCones& cones;
  const StoredCones* radii = nullptr;  ///< of cylinders that they are united with (safety_shape)
  std::optional<Wedge> wedge{};
  int threads = 0;
};
/// Texels whose open cone holds a texel's surface point that descends away from the apex.
[[nodiscard]] TexelVerdict verify_relaxed_texels(const RelaxedCones& request);
[[nodiscard]] RayVerdict verify_rays(const RelaxedCones& request, int rays);

}  // namespace reliefbench
