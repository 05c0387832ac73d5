#pragma once
#include <array>
#include <cmath>
#include <vector>

#include "kernels/base/rounding.h"
#include "kernels/maps/cone_map.h"

namespace reliefbench {

/// How far two texels are apart: distance2 = dx^2 weight_x + dy^2 weight_y - slack, dx and dy in texels. The unit is
/// chosen so that every distance2 is exact in a double: on a square map it is one texel.
struct ConeMetric {
  double weight_x = 1;
  double weight_y = 1;
  double slack = 0;  ///< what is taken off d^2 for bilinear-safe cones; under the smallest distance2
  double side = 1;   ///< length of one uv in the same unit: ratio = sqrt(distance2) / (side * height difference)
};
[[nodiscard]] ConeMetric cone_metric(int width, int height, Correction correction);

/// Two texels whose bound distance2 / (target_height - height)^2 is under `best`.
struct ConePair {
  double x, y;           ///< texel that owns the cone
  double dx, dy;         ///< texels from it to the target; under repeat to the nearest image, in (-side/2, side/2]
  double distance2;      ///< in the unit of ConeMetric
  double height;         ///< of the owner
  double target_height;  ///< greater than height
  double best;           ///< least key found yet
};

/// What a pair allows, where that is more than the target texel itself does (relaxed cones).
class PairKey {
 public:
  virtual ~PairKey() = default;
  /// returns: the pair's key, >= distance2 / (target_height - height)^2; anything >= best where it is not under best
  [[nodiscard]] virtual double operator()(const ConePair& pair) const = 0;
};

/// Texels that count, as the owner of a cone sees them: those at an offset o (texels) with, for all normals n,
/// n.x o.x + n.y o.y + margin (|n.x| + |n.y|) >= 0, that is those within `margin` texels of where the half-planes meet.
/// Under repeat the offsets are those to every image of a texel, not to the nearest one alone.
struct ConeView {
  struct Normal {
    double x = 0, y = 0;  ///< whole numbers
  };
  using Normals = std::array<Normal, 4>;    ///< those after the first of length 0 do not count
  const Heightfield* candidates = nullptr;  ///< heights of the texels that count, negative where one does not
  Normals normals{};
  double margin = 0;
};
/// Less than one texel per axis, and by less than any offset in whole numbers can tell: sums of a wedge's normal and
/// texels are whole, and |x| + |y| of a normal is under 2^22 up to 16384 texels a side.
inline constexpr double kLessThanOneTexel = 1 - 0x1p-24;

/// A sector of the directions in uv: where the half-planes of all normals meet.
struct Wedge {
  ConeView::Normals normals{};
  ConeView::Normal quadrant{};             ///< the signs of the quadrant that it is within; one is 0: of the half-plane
  double safe_margin = kLessThanOneTexel;  ///< texels within which targets count beside it, for `safe`
};
/// The quadrant of the signs x and y, its axes included; one is 0: the half-plane.
[[nodiscard]] ConeView quadrant_view(const Heightfield& candidates, int x, int y);
/// A wedge, its edges included. width, height: texels along one uv, which a finer grid under clamp has less of
[[nodiscard]] ConeView wedge_view(const Heightfield& candidates, int width, int height, const Wedge& wedge,
                                  double margin);
/// The sectors of `quad`, 90 degrees round +x, -x, +y and -y, in the order of its ratios.
inline constexpr std::array<Wedge, 4> kQuadWedges{{{.normals = {{{1, 1}, {1, -1}, {1, 0}}}, .quadrant = {1, 0}},
                                                   {.normals = {{{-1, -1}, {-1, 1}, {-1, 0}}}, .quadrant = {-1, 0}},
                                                   {.normals = {{{1, 1}, {-1, 1}, {0, 1}}}, .quadrant = {0, 1}},
                                                   {.normals = {{{-1, -1}, {1, -1}, {0, -1}}}, .quadrant = {0, -1}}}};

/// The heights of the texels whose cell in the quadrant of the signs x and y goes down along an edge, -1 for the
/// others: the candidates of a relaxed cone in that quadrant [BVBV24].
[[nodiscard]] Heightfield limiting_heights(const Heightfield& heights, Wrap wrap, int x, int y);

/// A wedge that has a cone of its own, and within how many texels of it targets count.
struct MarginedWedge {
  Wedge wedge;
  double margin = 0;
};
/// Those of bake_quad, in the order of its ratios.
[[nodiscard]] std::vector<MarginedWedge> quad_wedges(const BakeRequest& request);
/// Whether the map ends and owners or targets on its borders see, or are seen in, more than the wedge: search_wedge.
[[nodiscard]] bool is_bounded(const Wedge& wedge, Wrap wrap);

struct ConeSearch {
  const Heightfield& heights;
  Wrap wrap = Wrap::repeat;
  ConeMetric metric;
  float max_ratio = 1;
  const PairKey* pair_key = nullptr;  ///< null: distance2 / (target_height - height)^2, the conservative cone
  std::vector<ConeView> views{};      ///< a target counts that any of them has; empty: all texels count
  int threads = 0;
};

/// For every texel the ratio sqrt(min key) / side over all texels that are higher, at most max_ratio, rounded down to
/// float: never above the double-precision value. Branch and bound on a max pyramid, 4 x 4 texels a traversal. The
/// result has the bits of a loop over all pairs: bounds are pruned with a margin over float's rounding, the keys that
/// remain are evaluated in double, and a minimum does not depend on the order.
[[nodiscard]] std::vector<float> search_cones(const ConeSearch& search);

/// The key as a ratio, rounded down.
[[nodiscard]] inline float ratio_of_key(double key, const ConeMetric& metric) {
  return rounded_down(std::sqrt(key) / metric.side);
}

}  // namespace reliefbench
