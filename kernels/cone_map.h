#pragma once
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/heightfield.h"

namespace reliefbench {

enum class MapKind { height, conservative, relaxed_po07 };

/// What makes interpolated cones safe.
///
/// Theorem behind `safe`: let S_a = min over texels b of sqrt(|b-a|^2 - 1/2) / (N (H_b - H_a)), at most 1, distances in
/// texels. If every ratio is at most the 3x3 minimum of S, the interpolated cone at every point is disjoint from the
/// bilinear surface. Proof idea: couple the corner weights of the two points comonotonically per axis; |dX| then takes
/// only the two integers round |dx|, with variance at most 1/4; Jensen's inequality on sqrt(d^2 - 1/2) gives the bound
/// for distances of at least 1, a direct estimate below that.
enum class Correction {
  none,
  min3x3,  ///< 3x3 minimum of the texels' ratios [BVBV24]; not a guarantee
  safe,    ///< ratios from sqrt(d^2 - 1/2 texel^2), then the 3x3 minimum: no interpolated cone meets the surface
};

/// What a bake is made from. Cone ratio: tangent of the half aperture, uv per unit of height, in [0, 1].
struct BakeRequest {
  const Heightfield& heights;  ///< already quantised to the texture's format
  Wrap wrap = Wrap::repeat;
  Correction correction = Correction::none;
  int search_steps = 128;  ///< relaxed_po07 only: forward steps of the exit search, [PO07] listing 18-2
  int threads = 0;         ///< 0: as many as the machine has
};

/// A map kind: one row, one bake_*.cpp.
struct MapRow {
  MapKind kind;
  std::string_view id;
  std::string_view description;
  std::string_view source;
  std::string_view guarantee;               ///< what holds at texel centres, in words
  int channels;                             ///< 1: heights only
  std::span<const Correction> corrections;  ///< those that make sense; the first is the default
  bool has_search_steps;
  /// returns: width x height ratios, row-major; empty for `height`
  std::vector<float> (*bake)(const BakeRequest&);
  int version;  ///< part of the cache key; raised when the result changes
};
[[nodiscard]] std::span<const MapRow> map_kinds();
[[nodiscard]] const MapRow& find_map(MapKind kind);

[[nodiscard]] std::string_view correction_id(Correction correction);

/// The exact conservative cone map [DUM06]: for each texel min |v-u| / (H(v)-H(u)) over all texels v, clamped to 1.
/// Branch and bound on a max pyramid, bit-identical to brute force; the float is never above the double-precision
/// ratio. `safe` takes (1/width^2 + 1/height^2)/4 off the squared distance in uv; where one side is over 1.5 times the
/// other it halves the squared distance instead, which is as safe and leaves the cones open.
/// throws: Error(bad_input) if either side is under 2 texels
[[nodiscard]] std::vector<float> bake_conservative(const BakeRequest& request);

/// The relaxed cone map of [PO07] listings 18-1 and 18-2 (18-2's denominator), all pairs by branch and bound.
/// A ray leaves the top plate over one texel and passes through another's surface point, under repeat its nearest
/// image; it goes down to z = 0 in `search_steps` steps from there, and bounds the cone where it is first above the
/// bilinear surface again. It may end outside a clamped map. Through a point of the top plate itself the ray is level
/// (the listing divides by zero), and the point bounds the cone. Features thinner than a step may go unseen.
/// throws: Error(bad_input) if either side is under 2 texels, search_steps is under 1, or correction is `safe`
[[nodiscard]] std::vector<float> bake_relaxed_po07(const BakeRequest& request);

/// The minimum over each texel's 3x3 neighbourhood, wrapped.
[[nodiscard]] std::vector<float> min3x3(std::span<const float> ratios, int width, int height, Wrap wrap);

}  // namespace reliefbench
