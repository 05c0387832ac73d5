#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/image/heightfield.h"
#include "kernels/image/texture_image.h"

namespace reliefbench {

enum class MapKind {
  height,
  conservative,
  quick_naive,
  quick,
  quick_published,
  quick_centre,
  relaxed_po07,
  relaxed,
  quad,
  hybrid,
  safety_shape,
  max_mip,
  quadtree,
  distance,
  omni,
  double_height,
  double_cone,
  double_mip,
  sector,
  sector_relaxed,
  cell
};

/// What `bake --verify` holds a map to.
enum class MapPromise {
  none,
  conservative,  ///< no cone contains a texel's surface point
  relaxed,       ///< no ray crosses the surface twice before it leaves the cone
  exact_rays,    ///< every value is its ray's first hit, but for the format's rounding
};

/// What a baker returns for a map of width x height texels.
enum class MapContent {
  heights,  ///< nothing: the heights are the map
  ratios,   ///< MapRow::ratios cone ratios a texel, interleaved, row-major
  pyramid,  ///< levels of a mip chain below one another, level 0 first (see level_side); of solids two values a node
  volume,   ///< slices of width x height texels, bottom slice first
  table,    ///< one texel a ray, row by row of a texture that has its size from the parameters alone (OmniTable)
  sectors,  ///< one cone ratio a texel for each sector of directions, a layer of width x height after the other
};

/// What makes interpolated cones safe.
///
/// Theorem behind `safe`: let S_a = min over texels b of sqrt(|b-a|^2 - 1/2) / (N (H_b - H_a)), at most 1, distances in
/// texels. If every ratio is at most the 3x3 minimum of S, the interpolated cone at every point is disjoint from the
/// bilinear surface. Proof idea: couple the corner weights of the two points comonotonically per axis; |dX| then takes
/// only the two integers round |dx|, with variance at most 1/4; Jensen's inequality on sqrt(d^2 - 1/2) gives the bound
/// for distances of at least 1, a direct estimate below that.
enum class Correction {
  none,
  min3x3,     ///< 3x3 minimum of the texels' ratios [BVBV24]; not a guarantee
  safe,       ///< ratios from sqrt(d^2 - 1/2 texel^2), then the 3x3 minimum: no interpolated cone meets the surface
  certified,  ///< as safe, wider: texels raised as far as proved bounds inside the cells allow (certified_cones)
  min4,       ///< `safe`'s ratios as they are; the tracer takes the least of the four texels round the point, so that
              ///< none is interpolated
};
[[nodiscard]] std::span<const Correction> corrections();
[[nodiscard]] std::string_view correction_id(Correction correction);
[[nodiscard]] Correction find_correction(std::string_view id);  ///< throws: Error(bad_input) listing the choices

/// The widest ratio that a half float still holds: what an unbounded ratio is bounded by.
inline constexpr float kUnboundedRatio = 65504;

/// A parameter that one map kind's baker has for itself: an integer, or one of named choices (then the value is its
/// place). Settings of techniques on that map, `bake` and the cache's keys have it from the row.
struct MapParam {
  std::string_view id;
  std::string_view description;
  int min = 0;
  int max = 0;
  int fallback = 0;                             ///< the default
  std::span<const std::string_view> choices{};  ///< empty for a range
  bool is_constant = false;                     ///< shaders have it, as a specialization constant
  bool is_spelt_out = true;                     ///< ids have the default too, see Param
};
/// A value for a MapParam of that id.
struct MapValue {
  std::string_view param;
  int value = 0;
};
/// The parameter's value among some, its default where it is not.
[[nodiscard]] int given_value(std::span<const MapValue> values, const MapParam& param);

/// What a bake is made from. Cone ratio: tangent of the half aperture, uv per unit of height, in [0, max_ratio].
struct BakeRequest {
  const Heightfield& heights;  ///< already quantised to the texture's format
  Wrap wrap = Wrap::repeat;
  Correction correction = Correction::none;
  float max_ratio = 1;                 ///< 1 or kUnboundedRatio
  std::vector<MapValue> parameters{};  ///< of the map's own, in any order; one that is absent has its default
  int threads = 0;                     ///< 0: as many as the machine has

  [[nodiscard]] int value(const MapParam& param) const;
};

/// A map kind: one row, one bake_*.cpp.
struct MapRow {
  MapKind kind;
  std::string_view id;
  std::string_view description;
  std::string_view source;
  std::string_view guarantee;  ///< what holds at texel centres, in words
  MapContent content;
  int ratios = 0;                           ///< cone ratios a texel, or a texel of a layer
  std::span<const Correction> corrections;  ///< those that make sense; the first is the default
  std::span<const MapParam> parameters{};   ///< of its own
  MapPromise promise = MapPromise::none;
  bool is_solid = false;     ///< of heights with floors, which it keeps beside them; others see the upper surface alone
  bool is_relaxed = false;   ///< a ray may enter the relief inside its cone
  bool is_of_cells = false;  ///< its cones stand on the highest corners of cells and are fetched, not filtered
  bool sees_pairs = false;   ///< its baker looks at nearly every pair of texels: days for large maps
  std::vector<float> (*bake)(const BakeRequest&);
  /// Why there is no such map of any heights, or "" if there is; null: there always is.
  std::string (*refusal)(std::span<const MapValue> parameters) = nullptr;
  int version;  ///< part of the cache key; raised when the result changes
};
[[nodiscard]] std::span<const MapRow> map_kinds();
[[nodiscard]] const MapRow& find_map(MapKind kind);
[[nodiscard]] const MapRow& find_map(std::string_view id);  ///< throws: Error(bad_input) listing the choices

/// What a map keeps beside its heights in a texel: floors and ratios.
[[nodiscard]] inline int values_beside(const MapRow& map) { return map.ratios + (map.is_solid ? 1 : 0); }

/// throws: Error(bad_input) if either side is under 2 texels, or the texels are not width x height
void check_bakeable(const Heightfield& heights);
/// throws: Error(bad_input) also if the map kind has no such correction or parameter, or a value is out of range
void check_request(const BakeRequest& request, MapKind kind);

/// "search_steps=128": every parameter of the map's own, joined by '&'; "" for none. Part of a bake's key.
[[nodiscard]] std::string parameters_text(const BakeRequest& request, const MapRow& map);

}  // namespace reliefbench
