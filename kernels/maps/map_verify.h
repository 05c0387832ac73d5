#pragma once
#include <cstdint>
#include <vector>

#include "kernels/maps/map_texture.h"

namespace reliefbench {

struct VerifyRequest {
  const MapRow& map;  ///< content: ratios, sectors or table
  const MapTextures& textures;
  const Format& format;
  const Encoding& encoding;
  Correction correction = Correction::none;
  Wrap wrap = Wrap::repeat;
  int finest = 8;      ///< most points a texel
  int rays = 1 << 18;  ///< that are traced through relaxed cones
  int threads = 0;
  std::span<const MapValue> parameters{};  ///< of the map's own, as it was baked
};

/// How wrong the worst cone is: its ratio over the ratio of the point that it must not hold.
struct WorstCone {
  double factor = 1;
  double u = 0, v = 0;  ///< apex
};

/// Apexes inside cells, for cones that no point of the surface may be in. A cell is proved where cones of all its
/// points are narrower than lower bounds of the true ratios, broken where a point of the surface was found in a cone,
/// undecided otherwise.
struct CellVerdict {
  std::int64_t cells = 0, proved = 0, broken = 0, undecided = 0;
  int finest = 0;  ///< points a texel that were needed; 0: not examined
  WorstCone worst{};
};

/// Rays from the top plate through points over the relief, each seen inside the interpolated cone under such a point.
struct RayVerdict {
  std::int64_t rays = 0;            ///< that reach their point
  std::int64_t crossing_twice = 0;  ///< that enter and leave the relief again inside the cone
  WorstCone worst{};
};

/// Values of a table, each held against its own ray.
struct TableVerdict {
  std::int64_t values = 0;
  std::int64_t wrong = 0;  ///< farther from the exact hit than the format and a float round
  double worst_off = 0;    ///< of all, in heights
};

/// What a stored map was found to be.
struct MapVerdict {
  std::int64_t texels = 0;           ///< cones at texel centres; one a sector, and as many of each cell
  std::int64_t texels_too_wide = 0;  ///< cones at texel centres that another texel's surface point forbids; exact
  WorstCone worst_texel{};
  CellVerdict cells{};  ///< conservative cones
  RayVerdict rays{};    ///< relaxed cones
  TableVerdict table{};
  /// The kind's promise is shown not to hold: at a texel centre or, whatever the correction, at an interpolated
  /// position, where shaders read cones, too. A kind without a promise breaks none.
  bool broken = false;
  bool undecided = false;  ///< the promise is neither shown to hold nor not to hold

  /// Texels, cells, rays and values that were found wrong.
  [[nodiscard]] std::int64_t violations() const {
    return texels_too_wide + cells.broken + rays.crossing_twice + table.wrong;
  }
};

[[nodiscard]] bool can_be_verified(const MapRow& map);  ///< its content is ratios, sectors or a table

/// Verifies a map as it is stored: decoded by format and encoding, interpolated as shaders do but without their
/// rounding.
///
/// Conservative cones: texel centres are compared with the exact ratios, cells with the bounds of cone_bounds.h on
/// grids 1, 2, 4, 8 times finer, as far as cells are undecided (within kMaxFineSide).
/// The sectors of `quad` and of sector maps each by itself, likewise.
/// Relaxed cones: a texel is too wide where its cone holds a texel v whose surface descends away from the apex u,
/// (v-u).grad H(v) < 0 on either side of v ([BVBV24] section 5); between texels, rays are traced exactly; that finds
/// what is wrong, but proves nothing. safety_shape's rays are seen inside the union of its cone and cylinder.
/// Tables: every value is traced again, from the heights as they are stored.
/// throws: Error(bad_input): the map's content is none of these
[[nodiscard]] MapVerdict verify_map(const VerifyRequest& request);
[[nodiscard]] TableVerdict verify_omni(const VerifyRequest& request);  ///< the part for tables

}  // namespace reliefbench
